// SPDX-License-Identifier: Apache-2.0
//! Services of a Modbus device off the cycle: single registers, and its identity.
use super::link::{Line, Link};
use super::map::MappedChannel;
use super::pdu::{Request, Space, objects};
use super::turn::Turns;
use super::value::{Form, Of};
use device::{DeviceError, Kind, OptionWord, ServiceWord, Services};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use std::sync::Weak;

const SPACE: OptionWord = OptionWord::with_default("table", Kind::Text, "holding", "table: holding, input, coil or discrete");
const ADDRESS: OptionWord = OptionWord::needed("address", Kind::Whole, "as in the protocol: the first is 0").within(0.0, 65535.0);
const TYPE: OptionWord = OptionWord::with_default("type", Kind::Text, "uint16", Of::NAMES);
const ORDER: OptionWord = OptionWord::with_default("order", Kind::Text, "ABCD", "order of its bytes: ABCD, CDAB, BADC or DCBA");

pub(super) static SERVICES: [ServiceWord; 3] = [
    ServiceWord { name: "read_register", doc: "reads one number or bit", arguments: &[ADDRESS, SPACE, TYPE, ORDER], answer: Some(Kind::Number), moves: false },
    ServiceWord {
        name: "write_register",
        doc: "writes one number or coil that no channel of the device writes",
        arguments: &[ADDRESS, OptionWord::needed("value", Kind::Number, "a coil: 0 or 1").within(f64::NEG_INFINITY, f64::INFINITY), SPACE, TYPE, ORDER],
        answer: None,
        moves: false,
    },
    ServiceWord {
        name: "identification",
        doc: "reads the identity of the device: vendor, product, version",
        arguments: &[],
        answer: Some(Kind::Table),
        moves: false,
    },
];

/// Services carried out outside the exchange, in the device's turn on its line.
pub(super) struct Desk {
    link: Link<Weak<Turns<Line>>>,
    /// Write channels.
    outputs: Vec<MappedChannel>,
}

impl Desk {
    pub(super) fn new(link: Link<Weak<Turns<Line>>>, outputs: Vec<MappedChannel>) -> Desk {
        Desk { link, outputs }
    }

    fn read(&self, link: &Link, at: &At) -> Result<Value, DeviceError> {
        let answer = link.ask(&Request::Read { space: at.space, address: at.address, count: at.form.registers() })?;
        if at.space.is_bits() {
            return Ok(json!(answer.data().first().map_or(0, |bits| bits & 1)));
        }
        let mut bytes = [0; 8];
        at.form.read(answer.data(), &mut bytes);
        let value = f64::from_ne_bytes(bytes);
        // The number may have no representation in JSON.
        if value.is_finite() { Ok(json!(value)) } else { Err(wrong(&format!("{} {} holds {value}", at.space, at.address))) }
    }

    fn write(&self, link: &Link, at: &At, value: f64) -> Result<Value, DeviceError> {
        if !at.space.is_written() {
            return Err(wrong(&format!("a value in {} cannot be written; use holding or coil", at.space)));
        }
        let end = u32::from(at.address) + u32::from(at.form.registers());
        let owner = self.outputs.iter().find(|place| place.space == at.space && u32::from(place.address) < end && u32::from(at.address) < place.end());
        if let Some(owner) = owner {
            return Err(wrong(&format!("{} {} is written by channel '{}'; use a verb to command it", at.space, at.address, owner.name)));
        }
        let (wire, fits) =
            if at.space.is_bits() { ([u8::from(value != 0.0); 8], true) } else { at.form.write(&value.to_ne_bytes()).unwrap_or(([0; 8], false)) };
        if !fits {
            return Err(wrong(&format!("{value} does not fit {} {}", at.space, at.address)));
        }
        let count = at.form.registers();
        link.ask(&Request::Write { space: at.space, address: at.address, count, data: &wire[..at.space.bytes(count)] })?;
        Ok(Value::Null)
    }
}

impl Services for Desk {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        let link = self.link.upgrade().ok_or_else(|| wrong("the device is closed"))?;
        match service {
            "identification" => identification(&link),
            "read_register" => self.read(&link, &At::of(arguments)?),
            "write_register" => self.write(&link, &At::of(arguments)?, arguments["value"].as_f64().unwrap_or(f64::NAN)),
            other => Err(wrong(&format!("there is no service '{other}'"))),
        }
    }
}

/// Address passed in the arguments.
struct At {
    space: Space,
    address: u16,
    form: Form,
}

impl At {
    fn of(arguments: &Value) -> Result<At, DeviceError> {
        let address = arguments["address"].as_u64().and_then(|address| u16::try_from(address).ok()).ok_or_else(|| wrong("an address must be 0 to 65535"))?;
        let space = word(arguments, "table")?.unwrap_or(Space::Holding);
        let (of, order) = (word(arguments, "type")?.unwrap_or_default(), word(arguments, "order")?.unwrap_or_default());
        let form = if space.is_bits() { Form::Coil } else { Form::Scaled { of, order, scale: 1.0, offset: 0.0 } };
        match u32::from(address) + u32::from(form.registers()) <= 0x1_0000 {
            true => Ok(At { space, address, form }),
            false => Err(wrong("it extends beyond 65535, the last register")),
        }
    }
}

fn word<T: DeserializeOwned>(arguments: &Value, name: &str) -> Result<Option<T>, DeviceError> {
    let given = arguments.get(name).cloned().unwrap_or(Value::Null);
    serde_json::from_value(given).map_err(|why| wrong(&format!("{name}: {why}")))
}

fn wrong(message: &str) -> DeviceError {
    DeviceError { message: message.to_owned() }
}

/// Names of the identification objects in the standard.
const OBJECTS: [&str; 7] = ["vendor", "product_code", "version", "vendor_url", "product", "model", "application"];

/// Returns the identification of the device (function 43/14).
pub(super) fn identification(link: &Link) -> Result<Value, DeviceError> {
    let mut said = Map::new();
    let mut from = Some(0);
    // The loop is bounded, as a device might never end its list.
    for _ in 0..OBJECTS.len() {
        let Some(next) = from else { break };
        let answer = link.ask(&Request::Identify { from: next })?;
        let (each, more) = objects(answer.data());
        for (id, text) in each {
            let name = OBJECTS.get(usize::from(id)).map_or_else(|| format!("object_{id}"), |name| (*name).to_owned());
            said.insert(name, String::from_utf8_lossy(text).into());
        }
        from = more.filter(|more| *more > next);
    }
    Ok(Value::Object(said))
}
