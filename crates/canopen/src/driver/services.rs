// SPDX-License-Identifier: Apache-2.0
//! What the driver does beside its cycle: objects of its drives, network management, faults.
use crate::client::Client;
use crate::link::Place;
use crate::nmt::Command;
use cia402::Entry;
use device::{DeviceError, Kind, OptionWord, ServiceWord, Services};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

const AXIS: OptionWord = OptionWord::needed("axis", Kind::Text, "the name of the axis");
const INDEX: OptionWord = OptionWord::needed("index", Kind::Whole, "the index of the object, 0x6064 is its position");
const SUB: OptionWord = OptionWord::with_default("sub", Kind::Whole, "0", "the subindex");

pub const SERVICES: [ServiceWord; 5] = [
    ServiceWord {
        name: "read_object",
        doc: "reads an object of a drive: its bytes, and as a number where it has up to 8",
        arguments: &[AXIS, INDEX, SUB],
        answer: Some(Kind::Table),
    },
    ServiceWord {
        name: "write_object",
        doc: "writes an object of a drive",
        arguments: &[
            AXIS,
            INDEX,
            SUB,
            OptionWord::needed("value", Kind::Whole, "its value"),
            OptionWord::needed("bits", Kind::Whole, "8, 16, 32 or 64: how long it is"),
        ],
        answer: None,
    },
    ServiceWord {
        name: "nmt",
        doc: "tells a node to change its state; one that leaves operation loses the device",
        arguments: &[AXIS, OptionWord::needed("command", Kind::Text, "start, stop, pre_operational, reset or reset_communication")],
        answer: None,
    },
    ServiceWord { name: "save", doc: "has a drive store its settings (object 0x1010), so that they outlast its power", arguments: &[AXIS], answer: None },
    ServiceWord { name: "reset_fault", doc: "resets the fault of a drive with the next cycle", arguments: &[AXIS], answer: None },
];

/// What services share with the cycle: a flag for each axis. Their frames go their own way.
pub struct Shared {
    pub resets: Vec<AtomicBool>,
    axes: Vec<(String, u8)>,
    place: Place,
    client: Mutex<Option<Client>>,
}

impl Shared {
    pub fn new(place: Place, axes: Vec<(String, u8)>) -> Shared {
        Shared { resets: axes.iter().map(|_| AtomicBool::new(false)).collect(), axes, place, client: Mutex::new(None) }
    }

    /// From now on nodes are reached by this.
    pub fn reach(&self, client: Client) {
        *self.client.lock().unwrap_or_else(PoisonError::into_inner) = Some(client);
    }

    /// From now on nodes are not reached.
    pub fn leave(&self) {
        *self.client.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    fn on<T, E: std::fmt::Display>(&self, axis: usize, act: impl FnOnce(&mut Client, u8) -> Result<T, E>) -> Result<T, String> {
        let mut client = self.client.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(client) = client.as_mut() else {
            return Err(format!("the bus on '{}' is not open; open its device first", self.place));
        };
        let (name, node) = &self.axes[axis];
        act(client, *node).map_err(|why| format!("axis '{name}' (node {node}) {why}"))
    }

    fn carry_out(&self, service: &str, arguments: &Value) -> Result<Value, String> {
        let name = arguments["axis"].as_str().unwrap_or_default();
        let axis = self.axes.iter().position(|(of, _)| of == name).ok_or_else(|| {
            let names: Vec<&str> = self.axes.iter().map(|(name, _)| name.as_str()).collect();
            format!("there is no axis '{name}'; the axes are {}", names.join(", "))
        })?;
        match service {
            "reset_fault" => self.resets[axis].store(true, Ordering::Relaxed),
            "save" => self.on(axis, |client, node| client.download(node, Entry { index: 0x1010, sub: 1 }, b"save"))?,
            "nmt" => {
                let command = arguments["command"].as_str().and_then(Command::named);
                let command = command.ok_or_else(|| format!("command is {}", Command::NAMES))?;
                self.on(axis, |client, node| client.send(&command.frame(node)))?;
            }
            "read_object" => {
                let of = entry(arguments)?;
                return self.on(axis, |client, node| client.upload(node, of)).map(|value| shown(&value));
            }
            _ => {
                let (of, value) = (entry(arguments)?, value(arguments)?);
                self.on(axis, |client, node| client.download(node, of, &value))?;
            }
        }
        Ok(Value::Null)
    }
}

impl Services for Shared {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        self.carry_out(service, arguments).map_err(|message| DeviceError { message })
    }
}

fn entry(arguments: &Value) -> Result<Entry, String> {
    let whole = |word: &str, most: u64| match arguments[word].as_u64() {
        None if arguments[word].is_null() => Ok(0),
        Some(value) if value <= most => Ok(value),
        _ => Err(format!("{word} is 0 to {most:#x}")),
    };
    Ok(Entry { index: whole("index", 0xFFFF)? as u16, sub: whole("sub", 0xFF)? as u8 })
}

fn value(arguments: &Value) -> Result<Vec<u8>, String> {
    let value = arguments["value"].as_i64().ok_or("value is a whole number")?;
    match arguments["bits"].as_u64() {
        Some(bits @ (8 | 16 | 32 | 64)) => Ok(value.to_le_bytes()[..bits as usize / 8].to_vec()),
        _ => Err("bits is 8, 16, 32 or 64".to_owned()),
    }
}

fn shown(value: &[u8]) -> Value {
    let number = (value.len() <= 8).then(|| value.iter().rev().fold(0u64, |number, byte| number << 8 | u64::from(*byte)));
    let text = std::str::from_utf8(value).ok().filter(|text| !text.chars().any(char::is_control));
    let mut shown = json!({ "bytes": value });
    // What it is not is left out: a null is no value of an answer.
    number.into_iter().for_each(|number| shown["number"] = number.into());
    text.into_iter().for_each(|text| shown["text"] = text.into());
    shown
}
