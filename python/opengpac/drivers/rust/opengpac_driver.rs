// SPDX-License-Identifier: Apache-2.0
//! A driver in Rust, as `opengpac_driver.h` has it in C: a struct with the trait [`Driver`], and [`export`] once in its crate. What it promises is
//! what that header says: `read` and `write` are bounded and neither allocate, lock nor wait, unless its items have `worker()`.
#![allow(dead_code, clippy::missing_safety_doc)]
use crate::abi::{self, Cause, Channel, Module, Part, by, class, kind, what};
use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::atomic::{AtomicU64, Ordering};

pub use crate::abi::{Item, Slot};

/// What a function of a driver returns: nothing, or the cause for people.
pub type Done = Result<(), String>;

pub trait Driver: Sized + Send {
    const NAME: &'static CStr;
    const DOC: &'static CStr;
    /// Its manual: options, safe state, counters.
    const ITEMS: &'static [Item];

    /// Channels and parts, from the options. Nothing of the machine is touched.
    fn make(host: &mut Host) -> Result<Self, String>;
    /// Once before the first exchange: connects to the machine.
    fn open(&mut self, _now_ns: i64) -> Done {
        Ok(())
    }
    /// At the start of each firing. An error means that the device is lost.
    fn read(&mut self, release_ns: i64, readings: Readings) -> Done;
    /// At the end of each firing.
    fn write(&mut self, release_ns: i64, commands: Commands) -> Done;
    /// All outputs to their safe state now.
    fn safe_state(&mut self);
}

const fn item(what: u32, name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    let text = c"".as_ptr();
    Item { what, kind: 0, name: name.as_ptr(), doc: doc.as_ptr(), unit: unit.as_ptr(), text, number: 0.0, whole: 0, needed: 0, by: 0 }
}

/// An option that is a number, with its default.
pub const fn option_number(name: &'static CStr, default: f64, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind: kind::NUMBER, number: default, ..item(what::OPTION, name, doc, unit) }
}

/// An option that is a text and must be given.
pub const fn needed_text(name: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::TEXT, needed: 1, ..item(what::OPTION, name, doc, c"") }
}

/// It exchanges on a thread of its own, and may wait.
pub const fn worker() -> Item {
    Item { kind: class::WORKER, ..item(what::CLASS, c"", c"", c"") }
}

/// What its safe state is, and how soon the driver has brought it about, ns.
pub const fn safe(doc: &'static CStr, within_ns: i64) -> Item {
    Item { whole: within_ns, by: by::DRIVER, ..item(what::SAFE, c"", doc, c"") }
}

/// What it counts.
pub const fn counter(name: &'static CStr, doc: &'static CStr) -> Item {
    item(what::COUNTER, name, doc, c"")
}

/// What `make` may ask for and declare.
pub struct Host(*mut abi::Host);

impl Host {
    pub fn number(&mut self, name: &CStr) -> f64 {
        // SAFETY: a host lives as long as the call that has it, here and below.
        unsafe { ((*self.0).number)(self.0, name.as_ptr()) }
    }

    pub fn text(&mut self, name: &CStr) -> String {
        // SAFETY: as above; what is given is a text.
        unsafe { abi::text(((*self.0).text)(self.0, name.as_ptr())) }
    }

    pub fn counter(&mut self, name: &CStr) -> Counter {
        // SAFETY: as above.
        Counter(unsafe { ((*self.0).counter)(self.0, name.as_ptr()) }.cast())
    }

    /// A channel that is read: `"part.channel"`, of a type of C.
    pub fn reads(&mut self, of: &CStr, name: &CStr, doc: &CStr, unit: &CStr) -> Slot {
        self.channel(0, of, name, doc, unit, 0.0)
    }

    /// A channel that is written, with its safe value.
    pub fn writes(&mut self, of: &CStr, name: &CStr, safe: f64, doc: &CStr, unit: &CStr) -> Slot {
        self.channel(1, of, name, doc, unit, safe)
    }

    fn channel(&mut self, is_written: u32, of: &CStr, name: &CStr, doc: &CStr, unit: &CStr, safe: f64) -> Slot {
        let [name, type_text, doc, unit] = [name, of, doc, unit].map(CStr::as_ptr);
        let channel = Channel { size: size_of::<Channel>() as u32, is_written, name, type_text, doc, unit, safe, slew_max: 0.0 };
        // SAFETY: as above; the host copies it.
        unsafe { ((*self.0).channel)(self.0, &channel) }
    }

    /// Four channels are a joint: its position, velocity and bias, and the effort that moves it.
    pub fn joint(&mut self, name: &CStr, kp: f64, kd: f64) {
        let size = size_of::<Part>() as u32;
        let zero = Part { size, is_slide: 0, by_position: 0, reserved: 0, name: name.as_ptr(), range_min: 0.0, range_max: 0.0, effort_max: 0.0, speed_max: 0.0, home: 0.0, kp, kd };
        // SAFETY: as above; the host copies it.
        unsafe { ((*self.0).part)(self.0, &zero) };
    }
}

/// Where something is counted.
#[derive(Clone, Copy)]
pub struct Counter(*const AtomicU64);

// SAFETY: it is an atomic number that lives as long as the driver.
unsafe impl Send for Counter {}

impl Counter {
    pub fn add(self, more: u64) {
        // SAFETY: as above.
        unsafe { &*self.0 }.fetch_add(more, Ordering::Relaxed);
    }
}

/// Where readings are stored.
pub struct Readings(*mut u8);

impl Readings {
    pub fn set(&self, slot: Slot, value: f64) {
        // SAFETY: the host has given the slot.
        unsafe { self.0.add(slot.offset as usize).cast::<f64>().write_unaligned(value) };
    }
}

/// Commands, and which of them a running verb gives.
pub struct Commands(*const u8, *const u8);

impl Commands {
    pub fn get(&self, slot: Slot) -> f64 {
        // SAFETY: the host has given the slot, here and below.
        unsafe { self.0.add(slot.offset as usize).cast::<f64>().read_unaligned() }
    }

    pub fn is_engaged(&self, slot: Slot) -> bool {
        // SAFETY: as above.
        unsafe { *self.1.add(slot.index as usize) != 0 }
    }
}

/// The memory of a driver; all 0 before it is made.
struct Place<T> {
    driver: *mut T,
    cause: *mut c_char,
}

impl<T: Driver> Place<T> {
    unsafe fn at<'a>(memory: *mut c_void) -> &'a mut Place<T> {
        // SAFETY: the host gives memory of the size that was declared, to one call at a time.
        unsafe { &mut *memory.cast() }
    }

    /// None: it was not made, or is closed.
    fn driver(&mut self) -> Option<&mut T> {
        // SAFETY: null, or from `make`.
        unsafe { self.driver.as_mut() }
    }

    /// The cause stays until the next one.
    fn cause(&mut self, done: Done) -> Cause {
        let Err(why) = done else { return std::ptr::null() };
        self.forget();
        self.cause = CString::new(why.replace('\0', " ")).unwrap_or_default().into_raw();
        self.cause
    }

    fn forget(&mut self) {
        if !self.cause.is_null() {
            // SAFETY: it is from `cause`.
            drop(unsafe { CString::from_raw(std::mem::replace(&mut self.cause, std::ptr::null_mut())) });
        }
    }
}

unsafe extern "C" fn make<T: Driver>(memory: *mut c_void, host: *mut abi::Host) -> Cause {
    // SAFETY: see `Place::at`, here and below.
    let place = unsafe { Place::<T>::at(memory) };
    let made = T::make(&mut Host(host)).map(|driver| place.driver = Box::into_raw(Box::new(driver)));
    place.cause(made)
}

unsafe extern "C" fn open<T: Driver>(memory: *mut c_void, now_ns: i64) -> Cause {
    let place = unsafe { Place::<T>::at(memory) };
    let opened = place.driver().map_or(Ok(()), |driver| driver.open(now_ns));
    place.cause(opened)
}

unsafe extern "C" fn read<T: Driver>(memory: *mut c_void, release_ns: i64, readings: *mut u8) -> Cause {
    let place = unsafe { Place::<T>::at(memory) };
    let done = place.driver().map_or(Ok(()), |driver| driver.read(release_ns, Readings(readings)));
    place.cause(done)
}

unsafe extern "C" fn write<T: Driver>(memory: *mut c_void, release_ns: i64, commands: *const u8, engaged: *const u8) -> Cause {
    let place = unsafe { Place::<T>::at(memory) };
    let done = place.driver().map_or(Ok(()), |driver| driver.write(release_ns, Commands(commands, engaged)));
    place.cause(done)
}

unsafe extern "C" fn safe_state<T: Driver>(memory: *mut c_void) {
    if let Some(driver) = unsafe { Place::<T>::at(memory) }.driver() {
        driver.safe_state();
    }
}

unsafe extern "C" fn close<T: Driver>(memory: *mut c_void) {
    let place = unsafe { Place::<T>::at(memory) };
    if !place.driver.is_null() {
        // SAFETY: it is from `make`, and taken once.
        drop(unsafe { Box::from_raw(std::mem::replace(&mut place.driver, std::ptr::null_mut())) });
    }
    place.forget();
}

unsafe extern "C" fn table<T: Driver>() -> *const abi::Driver {
    Box::leak(Box::new(abi::Driver {
        size: size_of::<abi::Driver>() as u32,
        line: 0,
        name: T::NAME.as_ptr(),
        doc: T::DOC.as_ptr(),
        file: c"lib.rs".as_ptr(),
        items: T::ITEMS.as_ptr(),
        item_size: size_of::<Item>() as u32,
        item_count: T::ITEMS.len() as u32,
        instance_size: size_of::<Place<T>>() as u64,
        make: Some(make::<T>),
        open: Some(open::<T>),
        read: Some(read::<T>),
        write: Some(write::<T>),
        safe_state: Some(safe_state::<T>),
        close: Some(close::<T>),
        handles: None,
        service: None,
        scan: None,
    }))
}

/// What a file with this driver says of itself.
pub fn file<T: Driver>() -> *const Module {
    let drivers: &'static [unsafe extern "C" fn() -> *const abi::Driver] = Box::leak(Box::new([table::<T> as unsafe extern "C" fn() -> _]));
    let size = size_of::<Module>() as u32;
    Box::leak(Box::new(Module { abi: abi::ABI, size, drivers: drivers.as_ptr(), count: 1, reserved: 0, target: c"".as_ptr(), compiler: c"rustc".as_ptr() }))
}

/// Makes the crate a file of a driver: `export!(Axis);`.
#[macro_export]
macro_rules! export {
    ($driver:ty) => {
        #[unsafe(no_mangle)]
        pub extern "C" fn opengpac_driver_file() -> *const $crate::abi::Module {
            $crate::opengpac_driver::file::<$driver>()
        }
    };
}
