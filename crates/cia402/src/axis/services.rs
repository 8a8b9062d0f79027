// SPDX-License-Identifier: Apache-2.0
//! Services of a driver of axes, outside its cycle: object dictionary access, fault reset, homing.
use super::homing::Homes;
use super::stopped::held;
use crate::commander::Scale;
use crate::objects::Entry;
use device::{Kind, OptionWord, ServiceWord};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

pub const AXIS: OptionWord = OptionWord::needed("axis", Kind::Text, "the name of the axis");
const INDEX: OptionWord = OptionWord::needed("index", Kind::Whole, "the index of the object; 0x6064 is its position").within(0.0, 65535.0);
const SUB: OptionWord = OptionWord::with_default("sub", Kind::Whole, "0", "the subindex").within(0.0, 255.0);

pub const READ_OBJECT: ServiceWord = ServiceWord {
    name: "read_object",
    doc: "reads an object of a drive: its bytes, also as a number if it has up to 8",
    arguments: &[AXIS, INDEX, SUB],
    answer: Some(Kind::Table),
    moves: false,
};

pub const WRITE_OBJECT: ServiceWord = ServiceWord {
    name: "write_object",
    doc: "writes an object of a drive; while an emergency stop is latched, none that moves it or defines how it stops",
    arguments: &[
        AXIS,
        INDEX,
        SUB,
        OptionWord::needed("value", Kind::Whole, "its value").within(-9.3e18, 1.9e19),
        OptionWord::needed("bits", Kind::Whole, "8, 16, 32 or 64: its length").within(8.0, 64.0),
    ],
    answer: None,
    moves: false,
};

pub const RESET_FAULT: ServiceWord =
    ServiceWord { name: "reset_fault", doc: "resets the fault of a drive in the next cycle", arguments: &[AXIS], answer: None, moves: false };

/// Returns true if a service checks for emergency stops itself. `write_object` does so, because a stop forbids writing only some objects.
pub fn is_told_of_stops(service: &str) -> bool {
    service == WRITE_OBJECT.name
}

/// Access to the object dictionaries of the drives, outside the cycle. An axis is identified by its index in the driver.
pub trait Reach: Send {
    /// Reads an object dictionary entry.
    ///
    /// # Errors
    /// Fails with a message if the drive does not answer or aborts the transfer.
    fn upload(&mut self, axis: usize, of: Entry) -> Result<Vec<u8>, String>;

    /// Writes an object dictionary entry.
    ///
    /// # Errors
    /// Fails as [`Reach::upload`] does.
    fn download(&mut self, axis: usize, of: Entry, value: &[u8]) -> Result<(), String>;
}

/// State shared between services and the cycle: a flag for each axis. Messages to the drives use a separate path.
pub struct ServiceState<R> {
    pub homes: Homes,
    resets: Vec<AtomicBool>,
    names: Vec<String>,
    titles: Vec<String>,
    /// Refusal that is returned while the device is not open.
    closed: String,
    reached: Mutex<Option<R>>,
}

impl<R: Reach> ServiceState<R> {
    /// Creates the services of these axes, each with its name, its title for errors and its scale. `place` names the bus in the refusal
    /// that is returned while the device is not open: `the bus on 'can0'`.
    pub fn new(place: &str, axes: impl Iterator<Item = (String, String, Scale)>) -> ServiceState<R> {
        let (mut names, mut titles, mut scales) = (Vec::new(), Vec::new(), Vec::new());
        for (name, title, scale) in axes {
            names.push(name);
            titles.push(title);
            scales.push(scale);
        }
        let resets = names.iter().map(|_| AtomicBool::new(false)).collect();
        let closed = format!("{place} is not open; open its device first");
        ServiceState { resets, homes: Homes::new(scales), names, titles, closed, reached: Mutex::new(None) }
    }

    /// Sets the access to the drives.
    pub fn reach(&self, by: R) {
        *self.reached.lock().unwrap_or_else(PoisonError::into_inner) = Some(by);
    }

    /// Drops the access to the drives and ends all homing.
    pub fn leave(&self) {
        self.homes.end();
        *self.reached.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Calls `act` with the access to the drives, on behalf of an axis.
    ///
    /// # Errors
    /// Fails if the device is not open, or with the error of `act`, preceded by the name of the axis.
    pub fn on<T>(&self, axis: usize, act: impl FnOnce(&mut R) -> Result<T, String>) -> Result<T, String> {
        let mut reached = self.reached.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(reached) = reached.as_mut() else { return Err(self.closed.clone()) };
        act(reached).map_err(|error| format!("{}: {error}", self.titles[axis]))
    }

    /// Returns the axis named in the arguments.
    ///
    /// # Errors
    /// Fails if there is no axis with that name.
    pub fn axis(&self, arguments: &Value) -> Result<usize, String> {
        let name = arguments["axis"].as_str().unwrap_or_default();
        self.names.iter().position(|of| of == name).ok_or_else(|| format!("there is no axis '{name}'; the axes are {}", self.names.join(", ")))
    }

    /// Executes [`READ_OBJECT`], [`WRITE_OBJECT`], [`RESET_FAULT`] or [`HOME`](super::HOME). `is_stopped` returns true if an emergency
    /// stop is latched.
    ///
    /// # Errors
    /// Fails with a message.
    pub fn carry_out(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, String> {
        let axis = self.axis(arguments)?;
        match service {
            "reset_fault" => self.resets[axis].store(true, Ordering::Relaxed),
            "home" => return self.home(arguments, is_stopped),
            "read_object" => {
                let of = entry(arguments)?;
                return self.on(axis, |reached| reached.upload(axis, of)).map(|value| shown(&value));
            }
            _ => {
                let (of, value) = (entry(arguments)?, value(arguments)?);
                self.on(axis, |reached| {
                    // This check follows the wait for other services, during which a stop may have been latched.
                    may_be_written(of, is_stopped)?;
                    reached.download(axis, of, &value)
                })?;
            }
        }
        Ok(Value::Null)
    }

    /// Executes [`HOME`](super::HOME). `is_stopped` returns true if an emergency stop is latched. A stop that is latched during the
    /// homing ends it.
    ///
    /// # Errors
    /// Fails with a message.
    pub fn home(&self, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, String> {
        let axis = self.axis(arguments)?;
        let titled = |error| format!("{}: {error}", self.titles[axis]);
        let begun = self.homes.begin(is_stopped).map_err(titled)?;
        for (of, value) in self.homes.objects(axis, arguments)? {
            self.on(axis, |reached| reached.download(axis, of, &value))?;
        }
        self.homes.go(axis, begun, arguments).map_err(titled)
    }

    /// Returns true, once per request, if a fault of the axis must be reset. Real-time safe.
    pub fn resets(&self, axis: usize) -> bool {
        self.resets[axis].swap(false, Ordering::Relaxed)
    }
}

fn may_be_written(of: Entry, is_stopped: &dyn Fn() -> bool) -> Result<(), String> {
    match held(of) {
        Some(what) if is_stopped() => {
            Err(format!("object {:#06x}:{} is {what}, but an emergency stop is latched: remove its cause and reset it first", of.index, of.sub))
        }
        _ => Ok(()),
    }
}

/// Returns the object dictionary entry specified by `index` and `sub` in the arguments.
///
/// # Errors
/// Fails if one of them is out of range.
pub fn entry(arguments: &Value) -> Result<Entry, String> {
    let whole = |word: &str, maximum: u64| match arguments[word].as_u64() {
        None if arguments[word].is_null() => Ok(0),
        Some(value) if value <= maximum => Ok(value),
        _ => Err(format!("{word} must be 0 to {maximum:#x}")),
    };
    Ok(Entry { index: whole("index", 0xFFFF)? as u16, sub: whole("sub", 0xFF)? as u8 })
}

fn value(arguments: &Value) -> Result<Vec<u8>, String> {
    let value = arguments["value"].as_i64().ok_or("value must be a whole number")?;
    match arguments["bits"].as_u64() {
        Some(bits @ (8 | 16 | 32 | 64)) => Ok(value.to_le_bytes()[..bits as usize / 8].to_vec()),
        _ => Err("bits must be 8, 16, 32 or 64".to_owned()),
    }
}

fn shown(value: &[u8]) -> Value {
    let number = (value.len() <= 8).then(|| value.iter().rev().fold(0u64, |number, byte| number << 8 | u64::from(*byte)));
    let text = std::str::from_utf8(value).ok().filter(|text| !text.chars().any(char::is_control));
    let mut shown = json!({ "bytes": value });
    // Missing values are left out: an answer does not contain null.
    number.into_iter().for_each(|number| shown["number"] = number.into());
    text.into_iter().for_each(|text| shown["text"] = text.into());
    shown
}
