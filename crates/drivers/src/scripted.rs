// SPDX-License-Identifier: Apache-2.0
//! Channels of any numeric type that read a table of values: a physical device for tests.
//!
//! Options: `channels`, a list of `{name, direction: "read" | "write", type: "double" | "float" | "bool" | "int8_t" … "uint64_t" or such
//! a type with `[n]`, unit, safe, slew, loop_of}`, and `table`, a list of rows `{at_ns, values: {name: number or list}}`: from `at_ns`
//! after opening, those read channels have those values (0 before). A read channel with `loop_of: "<write channel>"` of the same type
//! instead reads the last value written to that channel. A write channel whose claim ends receives its safe value from the kernel, as for
//! any device.
use device::{
    Channel, Declaration, DeviceError, Direction, Driver, DriverError, GivenOptions, Kind, Layout, Number, OpenedDriver, OptionWord, SafeState, Type,
};
use serde::Deserialize;
use serde_json::{Map, Value, json};

pub(crate) static DRIVER: Declaration = Declaration {
    safe_state: SafeState::OF_SIMULATION,
    ..Declaration::new("scripted", "channels of any numeric type that read a table of values, for tests", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 2] = [
    OptionWord::needed("channels", Kind::List, "tables of name, direction, type, unit, safe, slew and loop_of").entries(&[&CHANNEL]),
    OptionWord::with_default("table", Kind::List, "every read channel stays 0", "rows of at_ns and values").entries(&[&ROW]),
];

const CHANNEL: [OptionWord; 1] = [OptionWord::with_default("slew", Kind::Number, "none", "its maximum rate, per second").above(0.0, 1e15)];
const ROW: [OptionWord; 1] = [OptionWord::needed("at_ns", Kind::Whole, "since the opening").unit("ns").within(0.0, f64::INFINITY)];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    channels: Vec<ChannelOptions>,
    #[serde(default)]
    table: Vec<RowOptions>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelOptions {
    name: String,
    direction: String,
    r#type: String,
    #[serde(default)]
    unit: String,
    safe: Option<Value>,
    slew: Option<f64>,
    loop_of: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RowOptions {
    at_ns: i64,
    values: Map<String, Value>,
}

/// Bytes that are read at `offset` from time `at_ns` on.
struct Row {
    at_ns: i64,
    offset: usize,
    bytes: Vec<u8>,
}

/// A read channel that mirrors a write channel: (offset in the readings, offset in the commands, length in bytes).
type Loop = (usize, usize, usize);

struct ScriptedDriver {
    channels: Vec<Channel>,
    rows: Vec<Row>,
    next: usize,
    loops: Vec<Loop>,
    opened_ns: i64,
    readings: Vec<u8>,
    commands: Vec<u8>,
}

/// Creates the device. Errors name the invalid channel or row.
fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let wrong = |option: &str, problem: String| given.wrong(option, problem);
    let options: Options = given.read()?;
    let mut layout = Layout::default();
    for asked in &options.channels {
        if layout.has(&asked.name) {
            return Err(wrong("channels", format!("'{}' is named twice", asked.name)));
        }
        layout.add(channel(asked).map_err(|problem| wrong("channels", format!("'{}': {problem}", asked.name)))?);
    }
    let (read_len, write_len) = (layout.readings_len(), layout.commands_len());
    let channels = layout.into_channels();
    let mut loops = Vec::new();
    for (given, channel) in options.channels.iter().zip(&channels) {
        let Some(source) = &given.loop_of else { continue };
        let written = channels.iter().find(|c| &c.name == source && c.direction == Direction::Write && c.type_text == channel.type_text);
        match written {
            Some(w) if channel.direction == Direction::Read => loops.push((channel.offset, w.offset, w.len)),
            _ => {
                return Err(wrong(
                    "loop_of",
                    format!("'{}' cannot show '{source}', which must be a written channel of type {}", channel.name, channel.type_text),
                ));
            }
        }
    }
    let mut rows = Vec::new();
    for row in &options.table {
        for (name, value) in &row.values {
            let channel = channels
                .iter()
                .find(|c| &c.name == name && c.direction == Direction::Read)
                .ok_or_else(|| wrong("table", format!("there is no read channel '{name}'")))?;
            rows.push(Row {
                at_ns: row.at_ns,
                offset: channel.offset,
                bytes: channel.type_text.parse().and_then(|of| encode(of, value)).map_err(|e| wrong("table", format!("'{name}': {e}")))?,
            });
        }
    }
    rows.sort_by_key(|row| row.at_ns);
    let device = ScriptedDriver { channels, rows, next: 0, loops, opened_ns: 0, readings: vec![0; read_len], commands: vec![0; write_len] };
    Ok((Box::new(device), json!({ "parts": [] })))
}

fn channel(given: &ChannelOptions) -> Result<Channel, String> {
    let of: Type = given.r#type.parse()?;
    let channel = match given.direction.as_str() {
        "read" => Channel::read(&given.name, of),
        "write" => Channel::write(&given.name, of),
        other => return Err(format!("direction '{other}' is neither read nor write")),
    };
    let channel = channel.unit(&given.unit).doc("scripted").slew(given.slew);
    match (&given.safe, channel.direction) {
        (Some(value), Direction::Write) => Ok(channel.safe(encode(of, value)?)),
        _ => Ok(channel),
    }
}

/// Returns the bytes of a number, of a Boolean, or of a list of either. `"nan"` and `"inf"` are values of a double.
fn encode(of: Type, value: &Value) -> Result<Vec<u8>, String> {
    let one = [value.clone()];
    let values: &[Value] = value.as_array().map_or(&one, |list| list);
    if values.len() != of.count() {
        return Err(format!("{} values for a {of}", values.len()));
    }
    let mut bytes = Vec::new();
    for value in values {
        let no = || format!("{value} is not of type {}", of.number.name());
        let whole = || value.as_i64().or_else(|| value.as_bool().map(i64::from)).ok_or_else(no);
        match of.number {
            Number::Double => bytes.extend(real(value).ok_or_else(no)?.to_ne_bytes()),
            Number::Float => bytes.extend((real(value).ok_or_else(no)? as f32).to_ne_bytes()),
            Number::Bool => bytes.push(value.as_bool().ok_or_else(no)? as u8),
            Number::Uint64 => bytes.extend(value.as_u64().ok_or_else(no)?.to_ne_bytes()),
            other => bytes.extend(&whole()?.to_le_bytes()[..other.width()]),
        }
    }
    Ok(bytes)
}

fn real(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.parse().ok())
}

impl Driver for ScriptedDriver {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.opened_ns = now_ns;
        self.next = 0;
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        while let Some(row) = self.rows.get(self.next).filter(|row| row.at_ns <= release_ns - self.opened_ns) {
            self.readings[row.offset..row.offset + row.bytes.len()].copy_from_slice(&row.bytes);
            self.next += 1;
        }
        for (to, from, len) in &self.loops {
            self.readings[*to..to + len].copy_from_slice(&self.commands[*from..from + len]);
        }
        readings[..self.readings.len()].copy_from_slice(&self.readings);
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], _: &[bool]) -> Result<(), DeviceError> {
        let len = self.commands.len();
        self.commands.copy_from_slice(&commands[..len]);
        Ok(())
    }

    fn safe_state(&mut self) {
        for channel in self.channels.iter().filter(|c| c.direction == Direction::Write) {
            self.commands[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
        }
    }

    fn close(&mut self) {
        self.safe_state();
    }
}
