// SPDX-License-Identifier: Apache-2.0
//! Mapping of channels to the tables of a device, as declared by a program.
use super::pdu::Space;
use super::value::{Form, Of, Order};
use device::{Channel, Kind, Layout, OptionWord, Slot};
use serde::Deserialize;
use serde_json::{Map, Value};

const FIRST: &str = "none: give one of the tables";

/// Numeric options of a channel.
pub(super) const CHANNEL: [OptionWord; 9] = [
    OptionWord::with_default("holding", Kind::Whole, FIRST, "its address in the holding registers").within(0.0, 65535.0),
    OptionWord::with_default("input", Kind::Whole, FIRST, "its address in the input registers").within(0.0, 65535.0),
    OptionWord::with_default("coil", Kind::Whole, FIRST, "its address in the coils").within(0.0, 65535.0),
    OptionWord::with_default("discrete", Kind::Whole, FIRST, "its address in the discrete inputs").within(0.0, 65535.0),
    OptionWord::with_default("scale", Kind::Number, "1", "value of one count of the register").within(-1e15, 1e15),
    OptionWord::with_default("offset", Kind::Number, "0", "its value at 0 counts").within(-1e15, 1e15),
    OptionWord::with_default("bit", Kind::Whole, "none", "the bit of the register that it is").within(0.0, 15.0),
    OptionWord::with_default("every_ns", Kind::Whole, "each period", "interval between readings").unit("ns").within(0.0, 3.6e12),
    OptionWord::with_default("slew", Kind::Number, "none", "its maximum rate, per second").above(0.0, 1e15),
];

/// A channel as declared by the program. Its address is given under the name of its table: `holding`, `input`, `coil` or `discrete`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelOptions {
    holding: Option<u16>,
    input: Option<u16>,
    coil: Option<u16>,
    discrete: Option<u16>,
    r#type: Option<Of>,
    #[serde(default)]
    order: Order,
    scale: Option<f64>,
    offset: Option<f64>,
    bit: Option<u8>,
    byte: Option<Byte>,
    #[serde(default)]
    raw: bool,
    write: Option<Value>,
    safe: Option<Value>,
    every_ns: Option<i64>,
    slew: Option<f64>,
    #[serde(default)]
    unit: String,
    #[serde(default)]
    doc: String,
}

/// High or low byte of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Byte {
    High,
    Low,
}

/// Side of the protocol that the driver implements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// The driver is a client, which polls a device.
    Client,
    /// The driver is the device that clients poll; it reads the values that they wrote.
    Server,
}

/// Condition under which a channel is written to the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Write {
    /// Never written, because the channel is read.
    Never,
    /// Written if the value on the wire has changed.
    Changed,
    /// Written in each period.
    Each,
}

impl Write {
    fn of(asked: Option<&Value>) -> Result<Write, String> {
        match asked {
            None | Some(Value::Bool(false)) => Ok(Write::Never),
            Some(Value::Bool(true)) => Ok(Write::Changed),
            Some(Value::String(word)) if word == "changed" => Ok(Write::Changed),
            Some(Value::String(word)) if word == "each" => Ok(Write::Each),
            Some(other) => Err(format!("\"write\": {other}: give true or \"changed\", or \"each\" to write in each period")),
        }
    }
}

/// A channel and its location in a table.
#[derive(Clone, Debug)]
pub(super) struct MappedChannel {
    pub name: String,
    pub space: Space,
    pub address: u16,
    pub form: Form,
    pub slot: Slot,
    pub write: Write,
    pub safe: Vec<u8>,
    pub every_ns: i64,
}

impl MappedChannel {
    /// Returns the number of registers or bits of the channel.
    pub(super) fn count(&self) -> u16 {
        self.form.registers()
    }

    /// Returns true if the channel is a part of a register, the other bits of which belong to other channels or to the device.
    pub(super) fn is_part(&self) -> bool {
        self.form.mask() != u16::MAX
    }

    /// Returns the address after the last address of the channel.
    pub(super) fn end(&self) -> u32 {
        u32::from(self.address) + u32::from(self.count())
    }
}

/// Returns the channels and their locations, in order of declaration.
///
/// # Errors
/// Returns a message that names the invalid channel.
pub(super) fn places(declared: &Map<String, Value>, end: End) -> Result<(Vec<Channel>, Vec<MappedChannel>), String> {
    let mut layout = Layout::default();
    let mut places = Vec::new();
    for (name, value) in declared {
        let (channel, place) = place(name, value, end).map_err(|why| format!("'{name}': {why}"))?;
        let slot = layout.add(channel);
        places.push(MappedChannel { slot, ..place });
    }
    overlap(&places, end)?;
    match places.is_empty() {
        true => Err("name at least one channel: {\"speed\": {\"input\": 0, \"type\": \"float\"}}".to_owned()),
        false => Ok((layout.into_channels(), places)),
    }
}

/// Checks that no channel overlaps another one.
fn overlap(places: &[MappedChannel], end: End) -> Result<(), String> {
    let mut claimed: Vec<&MappedChannel> = places.iter().filter(|place| end == End::Server || place.write != Write::Never).collect();
    // Sorted by masks too, so that overlapping parts of one register are neighbours.
    claimed.sort_by_key(|place| (place.space, place.address, place.form.mask()));
    for pair in claimed.windows(2) {
        let [one, other] = pair else { continue };
        let is_written = [one, other].map(|place| place.write != Write::Never);
        let meet = one.space == other.space && one.end() > u32::from(other.address);
        if !meet || is_written == [false, false] {
            continue;
        }
        if one.address != other.address || one.form.mask() & other.form.mask() != 0 {
            return Err(format!("'{}' and '{}' are both at {} {}", one.name, other.name, other.space, other.address));
        }
        if is_written[0] != is_written[1] {
            let why = "a register is written as a whole, either by clients or by this machine";
            return Err(format!("'{}' and '{}' are parts of {} {}: {why}", one.name, other.name, other.space, other.address));
        }
    }
    Ok(())
}

fn place(name: &str, value: &Value, end: End) -> Result<(Channel, MappedChannel), String> {
    let asked: ChannelOptions = serde_json::from_value(value.clone()).map_err(|why| why.to_string())?;
    let write = Write::of(asked.write.as_ref())?;
    let tables = [(Space::Holding, asked.holding), (Space::Input, asked.input), (Space::Coil, asked.coil), (Space::Discrete, asked.discrete)];
    let mut given = tables.into_iter().filter_map(|(space, address)| address.map(|address| (space, address)));
    let (Some((space, address)), None) = (given.next(), given.next()) else {
        return Err("give its address in one table: \"holding\", \"input\", \"coil\" or \"discrete\"".to_owned());
    };
    match end {
        End::Client if write != Write::Never && !space.is_written() => {
            return Err(format!("a client cannot write to the table \"{space}\"; use \"holding\" or \"coil\""));
        }
        End::Server if write == Write::Never && !space.is_written() => {
            return Err(format!(
                "a client cannot write to the table \"{space}\", so this channel would get no values; use \"holding\" or \"coil\", or \"write\": true"
            ));
        }
        _ => {}
    }
    let form = form(&asked, space)?;
    if u32::from(address) + u32::from(form.registers()) > 0x1_0000 {
        return Err(format!("it extends beyond {space} 65535, the last one"));
    }
    let channel = match write {
        Write::Never if asked.safe.is_some() || asked.slew.is_some() => return Err("a channel that is read cannot have \"safe\" or \"slew\"".to_owned()),
        Write::Never => Channel::read(name, form.channel_type()),
        _ => Channel::write(name, form.channel_type()).safe(safe(&asked, &form)?).slew(asked.slew),
    };
    let doc = if asked.doc.is_empty() { format!("{space} {address}") } else { format!("{} ({space} {address})", asked.doc) };
    let channel = channel.unit(&asked.unit).doc(doc);
    let safe = channel.safe.clone();
    let place =
        MappedChannel { name: name.to_owned(), space, address, form, slot: Slot { offset: 0, len: 0 }, write, safe, every_ns: asked.every_ns.unwrap_or(0) };
    Ok((channel, place))
}

fn form(asked: &ChannelOptions, space: Space) -> Result<Form, String> {
    let (scale, offset) = (asked.scale.unwrap_or(1.0), asked.offset.unwrap_or(0.0));
    if scale == 0.0 {
        return Err("its scale cannot be 0; give a scale other than 0".to_owned());
    }
    let numbers = [asked.r#type.is_some(), asked.scale.is_some(), asked.offset.is_some(), asked.raw, asked.order != Order::Abcd];
    match (asked.bit, asked.byte) {
        (Some(_), Some(_)) => return Err("it cannot be both a \"bit\" and a \"byte\"; give only one of them".to_owned()),
        (Some(_), _) | (_, Some(_)) if space.is_bits() => {
            return Err(format!("the table \"{space}\" already consists of single bits; leave out \"bit\" and \"byte\""));
        }
        (Some(16..), _) => return Err("a register has only the bits 0 to 15".to_owned()),
        (_, Some(_)) if asked.r#type.is_some() || asked.raw || asked.order != Order::Abcd => {
            return Err("a byte cannot have \"type\", \"order\" or \"raw\"; it is 0 to 255, with \"scale\" and \"offset\"".to_owned());
        }
        (_, Some(byte)) => return Ok(Form::Byte { is_high: byte == Byte::High, scale, offset }),
        (None, _) if !space.is_bits() => {}
        _ if numbers.contains(&true) => return Err("a bit cannot have \"type\", \"scale\", \"offset\", \"order\" or \"raw\"".to_owned()),
        (bit, _) => return Ok(bit.map_or(Form::Coil, Form::Bit)),
    }
    let (of, order) = (asked.r#type.unwrap_or_default(), asked.order);
    if asked.raw {
        return match asked.scale.is_some() || asked.offset.is_some() {
            true => Err("a raw value cannot have \"scale\" or \"offset\"".to_owned()),
            false => Ok(Form::Raw { of, order }),
        };
    }
    Ok(Form::Scaled { of, order, scale, offset })
}

/// Returns the bytes of the safe value: 0 or false by default.
fn safe(asked: &ChannelOptions, form: &Form) -> Result<Vec<u8>, String> {
    let len = form.channel_type().len();
    let Some(value) = &asked.safe else { return Ok(vec![0; len]) };
    let no = || format!("\"safe\": {value} is not of type {}", form.channel_type());
    match form {
        Form::Coil | Form::Bit(_) => value.as_bool().map(|bit| vec![u8::from(bit)]).ok_or_else(no),
        Form::Byte { .. } | Form::Scaled { .. } => {
            let bytes = value.as_f64().ok_or_else(no)?.to_ne_bytes().to_vec();
            match form.write(&bytes) {
                Some((_, true)) => Ok(bytes),
                _ => Err(format!("\"safe\": {value} does not fit the register")),
            }
        }
        // The number is converted through its registers.
        Form::Raw { of, order } => {
            let as_number = Form::Scaled { of: *of, order: *order, scale: 1.0, offset: 0.0 };
            let Some((wire, true)) = as_number.write(&value.as_f64().ok_or_else(no)?.to_ne_bytes()) else { return Err(no()) };
            let mut bytes = vec![0; len];
            form.read(&wire, &mut bytes);
            Ok(bytes)
        }
    }
}

/// Block that is read by one request: a range of one table, and the channels in it.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub space: Space,
    pub address: u16,
    pub count: u16,
    pub every_ns: i64,
    pub due_ns: i64,
    pub places: Vec<MappedChannel>,
}

/// Returns the minimum number of requests that read these channels: adjacent channels in the same table and with the same period are
/// merged, across at most `gap` undeclared addresses, up to the limit of the protocol.
pub(super) fn blocks(places: &[MappedChannel], gap: u16) -> Vec<Block> {
    let mut read: Vec<&MappedChannel> = places.iter().filter(|place| place.write == Write::Never).collect();
    read.sort_by_key(|place| (place.every_ns, place.space, place.address, place.count()));
    let mut blocks: Vec<Block> = Vec::new();
    for place in read {
        let joined = blocks.last_mut().filter(|last| {
            let end = u32::from(last.address) + u32::from(last.count);
            let count = place.end().max(end) - u32::from(last.address);
            (last.space, last.every_ns) == (place.space, place.every_ns)
                && u32::from(place.address) <= end + u32::from(gap)
                && count <= u32::from(place.space.read_max())
        });
        match joined {
            Some(last) => {
                last.count = last.count.max((place.end() - u32::from(last.address)) as u16);
                last.places.push(place.clone());
            }
            None => blocks.push(Block {
                space: place.space,
                address: place.address,
                count: place.count(),
                every_ns: place.every_ns,
                due_ns: i64::MIN,
                places: vec![place.clone()],
            }),
        }
    }
    blocks
}

impl Block {
    /// Stores the data read by the block's request into the readings.
    pub(super) fn store(&self, data: &[u8], readings: &mut [u8]) {
        for place in &self.places {
            let at = usize::from(place.address - self.address);
            let channel = place.slot.of_mut(readings);
            match self.space.is_bits() {
                true => channel[0] = data.get(at / 8).map_or(0, |byte| byte >> (at % 8) & 1),
                false => place.form.read(data.get(2 * at..).unwrap_or(&[]), channel),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn made(channels: Value) -> Result<Vec<MappedChannel>, String> {
        places(channels.as_object().expect("a table"), End::Client).map(|(_, places)| places)
    }

    #[test]
    fn neighbours_are_one_request_up_to_the_protocols_limits() {
        let many: Map<String, Value> = (0..300).map(|i| (format!("r{i}"), json!({ "holding": i }))).collect();
        let places = made(Value::Object(many)).expect("it is right");
        let ranges = |blocks: &[Block]| blocks.iter().map(|block| (block.address, block.count)).collect::<Vec<_>>();
        assert_eq!(ranges(&blocks(&places, 0)), [(0, 125), (125, 125), (250, 50)]);
        let apart = made(json!({ "b": { "input": 12, "type": "double" }, "a": { "input": 10, "type": "float" }, "c": { "input": 20 }, "d": { "input": 12 },
            "slow": { "input": 16, "every_ns": 1_000_000_000 }, "w": { "holding": 3, "write": "changed" } }))
        .expect("it is right");
        assert_eq!(ranges(&blocks(&apart, 0)), [(10, 6), (20, 1), (16, 1)]);
        assert_eq!(ranges(&blocks(&apart, 4)), [(10, 11), (16, 1)]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (channel, why) in [
            (json!({}), "give its address in one table"),
            (json!({ "holding": 1, "coil": 1 }), "give its address in one table"),
            (json!({ "holding": 65535, "type": "float" }), "it extends beyond holding 65535"),
            (json!({ "coil": 1, "type": "int16" }), "a bit cannot have \"type\""),
            (json!({ "holding": 1, "bit": 16 }), "the bits 0 to 15"),
            (json!({ "holding": 1, "bit": 1, "byte": "low" }), "both a \"bit\" and a \"byte\""),
            (json!({ "coil": 1, "byte": "low" }), "already consists of single bits"),
            (json!({ "holding": 1, "byte": "low", "type": "int16" }), "a byte cannot have \"type\""),
            (json!({ "holding": 1, "byte": "low", "write": true, "safe": 256 }), "does not fit the register"),
            (json!({ "holding": 1, "scale": 0.0 }), "its scale cannot be 0"),
            (json!({ "holding": 1, "safe": 1.0 }), "cannot have \"safe\" or \"slew\""),
            (json!({ "holding": 1, "write": "each", "safe": 70000 }), "does not fit the register"),
            (json!({ "holding": 1, "write": "each", "raw": true, "safe": -1 }), "is not of type uint16_t"),
            (json!({ "input": 1, "write": true }), "a client cannot write to the table \"input\""),
            (json!({ "holding": 1, "write": "often" }), "give true or \"changed\""),
            (json!({ "holding": 1, "typ": "int16" }), "unknown field `typ`"),
        ] {
            let refused = made(json!({ "x": channel.clone() })).expect_err(&channel.to_string());
            assert!(refused.starts_with("'x': ") && refused.contains(why), "{refused}");
        }
        let both = made(json!({ "a": { "holding": 1, "type": "float", "write": true }, "b": { "holding": 2, "write": true } }));
        assert_eq!(both.expect_err("they overlap"), "'a' and 'b' are both at holding 2");
    }

    #[test]
    fn parts_of_a_register_are_written_where_none_overlaps() {
        let part = |what: Value| {
            let mut part = json!({ "holding": 1, "write": true });
            part.as_object_mut().expect("a table").extend(what.as_object().expect("a table").clone());
            part
        };
        let (bit, byte) = (|bit: u8| part(json!({ "bit": bit })), |byte: &str| part(json!({ "byte": byte })));
        assert!(made(json!({ "a": bit(0), "b": bit(7), "c": byte("high"), "state": { "holding": 1 } })).is_ok());
        for overlapping in
            [json!({ "a": bit(3), "b": bit(0), "c": bit(3) }), json!({ "a": bit(3), "b": byte("low") }), json!({ "a": byte("high"), "b": bit(8), "c": bit(2) })]
        {
            assert!(made(overlapping.clone()).expect_err("they overlap").contains("both at holding 1"), "{overlapping}");
        }
        assert!(made(json!({ "a": bit(3), "b": { "holding": 0, "type": "float", "write": true } })).is_err());
        let mixed = json!({ "a": bit(3), "b": { "holding": 1, "bit": 4 } });
        assert!(made(mixed.clone()).is_ok());
        let refused = places(mixed.as_object().expect("a table"), End::Server).expect_err("clients write it, or the server");
        assert!(refused.contains("are parts of holding 1"), "{refused}");
    }
}
