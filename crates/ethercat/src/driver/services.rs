// SPDX-License-Identifier: Apache-2.0
//! What the driver does beside its cycle: objects of its drives, faults.
use super::homing::{HOME, Homes, Scale};
use crate::coe::Entry;
use crate::main_device::{Bus, Mailbox};
use device::{DeviceError, Kind, OptionWord, ServiceWord, Services};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

const AXIS: OptionWord = OptionWord::needed("axis", Kind::Text, "the name of the axis");
const INDEX: OptionWord = OptionWord::needed("index", Kind::Whole, "the index of the object, 0x6064 is its position");
const SUB: OptionWord = OptionWord::with_default("sub", Kind::Whole, "0", "the subindex");

pub(super) const SERVICES: [ServiceWord; 4] = [
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
    ServiceWord { name: "reset_fault", doc: "resets the fault of a drive with the next cycle", arguments: &[AXIS], answer: None },
    HOME,
];

/// What services share with the cycle: a flag for each axis. Their frames go their own way.
pub(super) struct Shared {
    pub resets: Vec<AtomicBool>,
    pub homes: Homes,
    names: Vec<String>,
    interface: String,
    reached: Mutex<Option<(Bus, Vec<Mailbox>)>>,
}

impl Shared {
    pub fn new(interface: String, names: Vec<String>, scales: Vec<Scale>) -> Shared {
        Shared { resets: names.iter().map(|_| AtomicBool::new(false)).collect(), homes: Homes::new(scales), names, interface, reached: Mutex::new(None) }
    }

    /// From now on these mailboxes are reached.
    pub fn reach(&self, mailboxes: Vec<Mailbox>) -> Result<(), String> {
        let bus = Bus::open(&self.interface)?;
        *self.reached.lock().unwrap_or_else(PoisonError::into_inner) = Some((bus, mailboxes));
        Ok(())
    }

    fn on(&self, axis: usize, act: impl FnOnce(&mut Bus, &mut Mailbox) -> Result<Value, String>) -> Result<Value, String> {
        let mut reached = self.reached.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((bus, mailboxes)) = reached.as_mut() else {
            return Err(format!("the segment on '{}' is not open; open its device first", self.interface));
        };
        act(bus, &mut mailboxes[axis]).map_err(|error| format!("axis '{}': {error}", self.names[axis]))
    }

    fn carry_out(&self, service: &str, arguments: &Value) -> Result<Value, String> {
        let name = arguments["axis"].as_str().unwrap_or_default();
        let axis = self.names.iter().position(|of| of == name).ok_or_else(|| format!("there is no axis '{name}'; the axes are {}", self.names.join(", ")))?;
        let whole = |word: &str, most: u64| match arguments[word].as_u64() {
            None if arguments[word].is_null() => Ok(0),
            Some(value) if value <= most => Ok(value),
            _ => Err(format!("{word} is 0 to {most:#x}")),
        };
        match service {
            "reset_fault" => {
                self.resets[axis].store(true, Ordering::Relaxed);
                Ok(Value::Null)
            }
            "home" => {
                for (of, value) in self.homes.objects(axis, arguments)? {
                    self.on(axis, |bus, mailbox| mailbox.download(bus, of, &value).map(|()| Value::Null))?;
                }
                self.homes.go(axis, arguments).map_err(|error| format!("axis '{name}': {error}"))
            }
            _ => {
                let of = Entry { index: whole("index", 0xFFFF)? as u16, sub: whole("sub", 0xFF)? as u8 };
                if service == "read_object" {
                    return self.on(axis, |bus, mailbox| mailbox.upload(bus, of).map(|value| shown(&value)));
                }
                let value = arguments["value"].as_i64().ok_or("value is a whole number")?;
                let len = match arguments["bits"].as_u64() {
                    Some(bits @ (8 | 16 | 32 | 64)) => bits as usize / 8,
                    _ => return Err("bits is 8, 16, 32 or 64".to_owned()),
                };
                self.on(axis, |bus, mailbox| mailbox.download(bus, of, &value.to_le_bytes()[..len]).map(|()| Value::Null))
            }
        }
    }
}

impl Services for Shared {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        self.carry_out(service, arguments).map_err(|message| DeviceError { message })
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
