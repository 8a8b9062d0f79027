// SPDX-License-Identifier: Apache-2.0
//! Functions that a driver in C may call during a call to it: for its options, channels and counters. An invalid request does not crash:
//! its result is 0 or empty, and the call fails with a description of the problem.
use super::abi::{self, ABI, Channel as AbiChannel, Handle, Host as AbiHost, Part as AbiPart, Slot as AbiSlot};
use device::{Channel, Command, Counters, FoundDevice, Layout, Number, Part, SafeHandle, Servo, Type, UNLIMITED};
use serde_json::{Map, Value};
use std::ffi::{CStr, CString, c_char};
use std::os::fd::BorrowedFd;

/// State of one call: its inputs and results.
#[derive(Default)]
pub(super) struct Host<'a> {
    /// Options or arguments, including defaults.
    pub(super) given: Map<String, Value>,
    /// Layout, present only during `make`.
    pub(super) layout: Option<Layout>,
    pub(super) counters: Option<&'a Counters>,
    pub(super) parts: Vec<Part>,
    pub(super) watchdog_ns: Option<i64>,
    pub(super) handles: Vec<SafeHandle>,
    pub(super) answer: Option<String>,
    pub(super) found: Vec<FoundDevice>,
    /// Strings that were returned to the driver; they live as long as this host.
    pub(super) texts: Vec<CString>,
    /// Problem with the first invalid request.
    pub(super) problem: Option<String>,
    /// Number of write channels so far.
    pub(super) written: u32,
    pub(super) read: u32,
}

/// Returns the defaults, overridden by the options that were set.
pub(super) fn filled(defaults: &Map<String, Value>, given: &Value) -> Map<String, Value> {
    let given = given.as_object().into_iter().flatten();
    defaults.iter().chain(given).map(|(name, value)| (name.clone(), value.clone())).collect()
}

impl Host<'_> {
    /// Creates a host with the defaults, overridden by the options that were set.
    pub(super) fn of(defaults: &Map<String, Value>, given: &Value) -> Self {
        Host { given: filled(defaults, given), ..Host::default() }
    }

    /// Makes a call. Fails with the driver's own cause, or with the problem of an invalid request.
    pub(super) fn call(&mut self, call: impl FnOnce(*mut AbiHost) -> abi::Cause) -> Result<(), String> {
        let mut host = AbiHost {
            abi: ABI,
            size: u32::try_from(size_of::<AbiHost>()).unwrap_or(0),
            at: std::ptr::from_mut(self).cast(),
            number,
            whole,
            text,
            json,
            length,
            number_at,
            text_at,
            channel,
            part,
            counter,
            watchdog,
            handle,
            answer,
            found,
        };
        let cause = call(&raw mut host);
        match self.problem.take() {
            Some(problem) => Err(problem),
            None if cause.is_null() => Ok(()),
            // SAFETY: a cause is a NUL-terminated string.
            None => Err(unsafe { abi::text(cause) }),
        }
    }

    fn wrong(&mut self, problem: String) {
        self.problem.get_or_insert(problem);
    }

    fn value(&mut self, name: *const c_char) -> Value {
        // SAFETY: a name is a NUL-terminated string.
        let name = unsafe { abi::text(name) };
        match self.given.get(&name) {
            Some(value) => value.clone(),
            None => {
                self.wrong(format!("it asks for '{name}', which it does not declare"));
                Value::Null
            }
        }
    }

    fn element(&mut self, name: *const c_char, index: i64) -> Value {
        let list = self.value(name);
        let element = usize::try_from(index).ok().and_then(|index| list.get(index).cloned());
        element.unwrap_or_else(|| {
            // SAFETY: a name is a NUL-terminated string.
            self.wrong(format!("it asks for element {index} of '{}', which is {list}", unsafe { abi::text(name) }));
            Value::Null
        })
    }

    fn keep(&mut self, text: &str) -> *const c_char {
        let text = CString::new(text.replace('\0', "")).unwrap_or_default();
        self.texts.push(text);
        self.texts.last().map_or(c"".as_ptr(), |text| text.as_ptr())
    }

    /// Returns a string; any other value is an invalid request.
    fn text_of(&mut self, value: &Value) -> *const c_char {
        match value {
            Value::String(text) => self.keep(text),
            Value::Null => c"".as_ptr(),
            other => {
                self.wrong(format!("{other} is not a string"));
                c"".as_ptr()
            }
        }
    }

    fn number_of(&mut self, value: &Value) -> f64 {
        match value.as_f64() {
            Some(number) => number,
            None => {
                if !value.is_null() {
                    self.wrong(format!("{value} is not a number"));
                }
                0.0
            }
        }
    }

    fn add(&mut self, given: &AbiChannel) -> Result<AbiSlot, String> {
        // SAFETY: these are the strings of a channel.
        let [name, type_text, doc, unit] = [given.name, given.type_text, given.doc, given.unit].map(|at| unsafe { abi::text(at) });
        let Some(layout) = &mut self.layout else { return Err(format!("channel '{name}' is declared outside of make")) };
        let of: Type = type_text.parse().map_err(|what| format!("channel '{name}': {what}"))?;
        if layout.has(&name) {
            return Err(format!("channel '{name}' is declared twice"));
        }
        let is_written = given.is_written != 0;
        let channel = if is_written { Channel::write(name, of).safe(safe_bytes(of, given.safe)) } else { Channel::read(name, of) };
        let channel = channel.unit(unit).doc(doc).slew((given.slew_max != 0.0).then_some(given.slew_max));
        let slot = layout.add(channel);
        let index = if is_written { &mut self.written } else { &mut self.read };
        let placed = AbiSlot { offset: u32::try_from(slot.offset).map_err(|_| "its channels are too large".to_owned())?, index: *index };
        *index += 1;
        Ok(placed)
    }

    fn add_handle(&mut self, given: &Handle) -> Result<(), String> {
        if given.descriptor < 0 || given.bytes.is_null() {
            return Err(format!("a safe handle has descriptor {} and {} bytes", given.descriptor, given.length));
        }
        // SAFETY: the driver keeps the descriptor open for the call; a copy is kept.
        let descriptor = unsafe { BorrowedFd::borrow_raw(given.descriptor) }.try_clone_to_owned();
        let descriptor = descriptor.map_err(|why| format!("the descriptor of a safe handle: {why}"))?;
        // SAFETY: the pointer is to that number of bytes.
        let bytes = unsafe { std::slice::from_raw_parts(given.bytes.cast::<u8>(), given.length as usize) }.to_vec();
        self.handles.push(SafeHandle { descriptor, writes: vec![(given.offset, bytes)], latches: given.latches != 0 });
        Ok(())
    }
}

/// Returns the safe value of a channel, with the same number in each element.
fn safe_bytes(of: Type, value: f64) -> Vec<u8> {
    let one: Vec<u8> = match of.number {
        Number::Bool => vec![u8::from(value != 0.0)],
        Number::Int8 => (value as i8).to_ne_bytes().into(),
        Number::Uint8 => (value as u8).to_ne_bytes().into(),
        Number::Int16 => (value as i16).to_ne_bytes().into(),
        Number::Uint16 => (value as u16).to_ne_bytes().into(),
        Number::Int32 => (value as i32).to_ne_bytes().into(),
        Number::Uint32 => (value as u32).to_ne_bytes().into(),
        Number::Int64 => (value as i64).to_ne_bytes().into(),
        Number::Uint64 => (value as u64).to_ne_bytes().into(),
        Number::Float => (value as f32).to_ne_bytes().into(),
        Number::Double => value.to_ne_bytes().into(),
    };
    one.repeat(of.count())
}

/// Returns the host of a call.
///
/// # Safety
/// The pointer must be the one passed to the driver, used within that call.
unsafe fn of<'h>(host: *mut AbiHost) -> &'h mut Host<'h> {
    // SAFETY: `at` is the `Host` of that call, which outlives it.
    unsafe { &mut *(*host).at.cast::<Host<'h>>() }
}

unsafe extern "C" fn number(host: *mut AbiHost, name: *const c_char) -> f64 {
    // SAFETY: see `of`; the same holds below.
    let host = unsafe { of(host) };
    let value = host.value(name);
    host.number_of(&value)
}

unsafe extern "C" fn whole(host: *mut AbiHost, name: *const c_char) -> i64 {
    // SAFETY: see `number`.
    let host = unsafe { of(host) };
    match host.value(name) {
        Value::Bool(truth) => i64::from(truth),
        Value::Null => 0,
        value => value.as_i64().unwrap_or_else(|| {
            host.wrong(format!("{value} is not a 64-bit whole number"));
            0
        }),
    }
}

unsafe extern "C" fn text(host: *mut AbiHost, name: *const c_char) -> *const c_char {
    // SAFETY: see `number`.
    let host = unsafe { of(host) };
    let value = host.value(name);
    host.text_of(&value)
}

unsafe extern "C" fn json(host: *mut AbiHost, name: *const c_char) -> *const c_char {
    // SAFETY: see `number`.
    let host = unsafe { of(host) };
    let value = host.value(name);
    host.keep(&value.to_string())
}

unsafe extern "C" fn length(host: *mut AbiHost, name: *const c_char) -> i64 {
    // SAFETY: see `number`.
    let host = unsafe { of(host) };
    host.value(name).as_array().map_or(0, |list| i64::try_from(list.len()).unwrap_or(i64::MAX))
}

unsafe extern "C" fn number_at(host: *mut AbiHost, name: *const c_char, index: i64) -> f64 {
    // SAFETY: see `number`.
    let host = unsafe { of(host) };
    let value = host.element(name, index);
    host.number_of(&value)
}

unsafe extern "C" fn text_at(host: *mut AbiHost, name: *const c_char, index: i64) -> *const c_char {
    // SAFETY: see `number`.
    let host = unsafe { of(host) };
    let value = host.element(name, index);
    host.text_of(&value)
}

unsafe extern "C" fn channel(host: *mut AbiHost, given: *const AbiChannel) -> AbiSlot {
    // SAFETY: see `number`; the channel is on the driver's stack.
    let (host, given) = unsafe { (of(host), &*given) };
    host.add(given).unwrap_or_else(|problem| {
        host.wrong(problem);
        AbiSlot::default()
    })
}

unsafe extern "C" fn part(host: *mut AbiHost, given: *const AbiPart) {
    // SAFETY: see `channel`.
    let (host, given) = unsafe { (of(host), &*given) };
    let limit = |value: f64| if value == 0.0 { UNLIMITED } else { value };
    host.parts.push(Part {
        // SAFETY: a name is a NUL-terminated string.
        name: unsafe { abi::text(given.name) },
        unit: if given.is_slide != 0 { "m" } else { "rad" },
        range_min: if given.range_min == 0.0 && given.range_max == 0.0 { -UNLIMITED } else { given.range_min },
        range_max: if given.range_min == 0.0 && given.range_max == 0.0 { UNLIMITED } else { given.range_max },
        effort_max: limit(given.effort_max),
        speed_max: limit(given.speed_max),
        home: given.home,
        servo: Servo { kp: given.kp, kd: given.kd },
        command: if given.by_position != 0 { Command::Position } else { Command::Effort },
    });
}

unsafe extern "C" fn counter(host: *mut AbiHost, name: *const c_char) -> *mut u64 {
    /// Counter for names that were not declared.
    static NOBODY: std::sync::atomic::AtomicU64 = std::sync::atomic::AtomicU64::new(0);
    // SAFETY: see `number`.
    let (host, name) = unsafe { (of(host), abi::text(name)) };
    let index = host.counters.and_then(|counters| counters.words().iter().position(|word| word.name == name));
    match (host.counters, index) {
        (Some(counters), Some(index)) => counters.address(index).cast_mut().cast(),
        _ => {
            host.wrong(format!("it asks for counter '{name}', which it does not declare, or does so outside of make"));
            NOBODY.as_ptr()
        }
    }
}

unsafe extern "C" fn watchdog(host: *mut AbiHost, ns: i64) {
    // SAFETY: see `number`.
    unsafe { of(host) }.watchdog_ns = Some(ns);
}

unsafe extern "C" fn handle(host: *mut AbiHost, given: *const Handle) {
    // SAFETY: see `channel`.
    let (host, given) = unsafe { (of(host), &*given) };
    if let Err(problem) = host.add_handle(given) {
        host.wrong(problem);
    }
}

unsafe extern "C" fn answer(host: *mut AbiHost, json: *const c_char) {
    // SAFETY: see `number`; the answer is a NUL-terminated string.
    unsafe { of(host) }.answer = Some(unsafe { abi::text(json) });
}

unsafe extern "C" fn found(host: *mut AbiHost, what: *const c_char, options_json: *const c_char) {
    // SAFETY: see `number`; both are NUL-terminated strings.
    let (host, what, json) = unsafe { (of(host), abi::text(what), CStr::from_ptr(options_json).to_string_lossy()) };
    match serde_json::from_str(&json) {
        Ok(options) => host.found.push(FoundDevice { what, options }),
        Err(_) => host.wrong(format!("the options of a device that it found, '{json}', are not JSON")),
    }
}
