// SPDX-License-Identifier: Apache-2.0
//! Requests and reports that a driver makes to the system that calls it, and the values of its channels.
use crate::abi::{self, Channel, Handle, Part, Slot};
use std::ffi::{CStr, CString};
use std::sync::atomic::{AtomicU64, Ordering};

/// Interface to the system, for use in `make`, services, `handles` and `scan`.
pub struct Host(pub(crate) *mut abi::Host);

impl Host {
    pub fn number(&mut self, name: &CStr) -> f64 {
        // SAFETY: a host is valid throughout the call that receives it, here and below.
        unsafe { ((*self.0).number)(self.0, name.as_ptr()) }
    }

    pub fn text(&mut self, name: &CStr) -> String {
        // SAFETY: as above; the host returns a text.
        unsafe { abi::text(((*self.0).text)(self.0, name.as_ptr())) }
    }

    pub fn whole(&mut self, name: &CStr) -> i64 {
        // SAFETY: as above.
        unsafe { ((*self.0).whole)(self.0, name.as_ptr()) }
    }

    pub fn bool(&mut self, name: &CStr) -> bool {
        self.whole(name) != 0
    }

    /// Returns an option of any kind as JSON, for example a list or a table.
    pub fn json(&mut self, name: &CStr) -> String {
        // SAFETY: as above; the host returns a text.
        unsafe { abi::text(((*self.0).json)(self.0, name.as_ptr())) }
    }

    /// Returns the length of a list option.
    pub fn length(&mut self, name: &CStr) -> i64 {
        // SAFETY: as above.
        unsafe { ((*self.0).length)(self.0, name.as_ptr()) }
    }

    /// Returns the number at an index (from 0) in a list option.
    pub fn number_at(&mut self, name: &CStr, index: i64) -> f64 {
        // SAFETY: as above.
        unsafe { ((*self.0).number_at)(self.0, name.as_ptr(), index) }
    }

    /// Returns the text at an index (from 0) in a list option.
    pub fn text_at(&mut self, name: &CStr, index: i64) -> String {
        // SAFETY: as above; the host returns a text.
        unsafe { abi::text(((*self.0).text_at)(self.0, name.as_ptr(), index)) }
    }

    /// Returns the counter with a declared name; called in `make`.
    pub fn counter(&mut self, name: &CStr) -> Counter {
        // SAFETY: as above.
        Counter(unsafe { ((*self.0).counter)(self.0, name.as_ptr()) }.cast())
    }

    /// Adds a read channel with the name `"part.channel"` and a C type.
    pub fn reads(&mut self, of: &CStr, name: &CStr, doc: &CStr, unit: &CStr) -> Slot {
        self.channel(0, of, name, doc, unit, 0.0)
    }

    /// Adds a write channel with its safe value.
    pub fn writes(&mut self, of: &CStr, name: &CStr, safe: f64, doc: &CStr, unit: &CStr) -> Slot {
        self.channel(1, of, name, doc, unit, safe)
    }

    fn channel(&mut self, is_written: u32, of: &CStr, name: &CStr, doc: &CStr, unit: &CStr, safe: f64) -> Slot {
        let [name, type_text, doc, unit] = [name, of, doc, unit].map(CStr::as_ptr);
        let channel = Channel { size: size_of::<Channel>() as u32, is_written, name, type_text, doc, unit, safe, slew_max: 0.0 };
        // SAFETY: as above; the host copies it.
        unsafe { ((*self.0).channel)(self.0, &channel) }
    }

    /// Adds a joint with four channels: its position, velocity and bias, and the effort that moves it.
    pub fn joint(&mut self, name: &CStr, kp: f64, kd: f64) {
        self.part(name, Part { kp, kd, ..Part::HINGE });
    }

    /// Adds a joint with its limits: `host.part(c"belt", Part { speed_max: 2.0, ..Part::SLIDE })`.
    pub fn part(&mut self, name: &CStr, part: Part) {
        let part = Part { name: name.as_ptr(), ..part };
        // SAFETY: as above; the host copies it.
        unsafe { ((*self.0).part)(self.0, &part) };
    }

    /// Sets the time without a command after which the device enters its safe state by itself; called in `make`.
    pub fn watchdog(&mut self, ns: i64) {
        // SAFETY: as above.
        unsafe { ((*self.0).watchdog)(self.0, ns) };
    }

    /// Adds bytes to be written to a descriptor after this process has exited; called in `handles`. With `latches`, they stay in force
    /// until a driver opens the device again.
    pub fn safe_handle(&mut self, descriptor: i32, offset: u64, bytes: &[u8], latches: bool) {
        let (size, length) = (size_of::<Handle>() as u32, bytes.len() as u32);
        let handle = Handle { size, latches: latches.into(), descriptor, length, offset, bytes: bytes.as_ptr().cast() };
        // SAFETY: as above; the host copies it.
        unsafe { ((*self.0).handle)(self.0, &handle) };
    }

    /// Sets the answer of a service, as JSON.
    pub fn answer(&mut self, json: &str) {
        let json = c_text(json);
        // SAFETY: as above; the host copies it.
        unsafe { ((*self.0).answer)(self.0, json.as_ptr()) };
    }

    /// Reports a device that `scan` has found, with the options that open it, as JSON.
    pub fn found(&mut self, what: &str, options_json: &str) {
        let (what, options) = (c_text(what), c_text(options_json));
        // SAFETY: as above; the host copies them.
        unsafe { ((*self.0).found)(self.0, what.as_ptr(), options.as_ptr()) };
    }
}

impl Part {
    /// A revolute joint without limits, in rad and N.m.
    pub const HINGE: Part = Part {
        size: size_of::<Part>() as u32,
        is_slide: 0,
        by_position: 0,
        reserved: 0,
        name: c"".as_ptr(),
        range_min: 0.0,
        range_max: 0.0,
        effort_max: 0.0,
        speed_max: 0.0,
        home: 0.0,
        kp: 0.0,
        kd: 0.0,
    };
    /// A prismatic joint without limits, in m and N.
    pub const SLIDE: Part = Part { is_slide: 1, ..Part::HINGE };
}

/// Returns a text as a C string.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// Counter of the driver.
#[derive(Clone, Copy)]
pub struct Counter(*const AtomicU64);

// SAFETY: the pointer leads to an atomic number that lives as long as the driver.
unsafe impl Send for Counter {}

impl Counter {
    pub fn add(self, more: u64) {
        // SAFETY: as above.
        unsafe { &*self.0 }.fetch_add(more, Ordering::Relaxed);
    }
}

/// Memory in which readings are stored.
pub struct Readings(pub(crate) *mut u8);

impl Readings {
    pub fn set(&self, slot: Slot, value: f64) {
        // SAFETY: the slot was issued by the host.
        unsafe { self.0.add(slot.offset as usize).cast::<f64>().write_unaligned(value) };
    }

    /// Stores the bytes of a value of a type other than `double`.
    pub fn set_bytes(&self, slot: Slot, value: &[u8]) {
        // SAFETY: as above; the channel was declared with a type of this length.
        unsafe { self.0.add(slot.offset as usize).copy_from_nonoverlapping(value.as_ptr(), value.len()) };
    }
}

/// Commands, and flags that indicate which of them are claimed by a running verb.
pub struct Commands(pub(crate) *const u8, pub(crate) *const u8);

impl Commands {
    pub fn get(&self, slot: Slot) -> f64 {
        // SAFETY: the slot was issued by the host, here and below.
        unsafe { self.0.add(slot.offset as usize).cast::<f64>().read_unaligned() }
    }

    /// Returns the `N` bytes of a value of a type other than `double`.
    pub fn get_bytes<const N: usize>(&self, slot: Slot) -> [u8; N] {
        // SAFETY: as above; the channel was declared with a type of this length.
        unsafe { self.0.add(slot.offset as usize).cast::<[u8; N]>().read_unaligned() }
    }

    pub fn is_engaged(&self, slot: Slot) -> bool {
        // SAFETY: as above.
        unsafe { *self.1.add(slot.index as usize) != 0 }
    }
}
