// SPDX-License-Identifier: Apache-2.0
//! A driver in Rust, the counterpart of `opengpac_driver.h` in C: a struct that implements the trait [`Driver`], and one [`export`] in
//! its crate. Its contract is that of the header: `read` and `write` take a bounded time and do not allocate, lock or block, unless the
//! driver's items contain `worker()`.
#![allow(dead_code, unused_imports, clippy::missing_safety_doc)]
use crate::abi::{self, Cause, Module};
use host::c_text;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::Arc;

#[path = "host.rs"]
mod host;
#[path = "items.rs"]
mod items;

pub use crate::abi::{Item, Part, Slot};
pub use host::{Commands, Counter, Host, Readings};
pub use items::*;

/// Result of a driver's function; the error is the cause, as human-readable text.
pub type Done = Result<(), String>;

pub trait Driver: Sized + Send {
    const NAME: &'static CStr;
    const DOC: &'static CStr;
    /// Manual of the driver: options, safe state, counters, services.
    const ITEMS: &'static [Item];
    /// True if the driver can search for devices with [`Driver::scan`].
    const SCANS: bool = false;

    /// Creates the driver, its channels and its parts from the options. Does not access the machine.
    fn make(host: &mut Host) -> Result<Self, String>;
    /// Connects to the machine; called once, before the first exchange.
    fn open(&mut self, _now_ns: i64) -> Done {
        Ok(())
    }
    /// Reads from the machine at the start of each firing. After an error, the device is lost.
    fn read(&mut self, release_ns: i64, readings: Readings) -> Done;
    /// Returns the time at which the machine took its readings, on the clock of `release_ns`; called after each `read`. If no new
    /// readings have arrived, it returns the previous time, and the channel `age` of the device grows. `None`, the default, represents
    /// the time of the read.
    fn taken_ns(&self) -> Option<i64> {
        None
    }
    /// Writes to the machine at the end of each firing.
    fn write(&mut self, release_ns: i64, commands: Commands) -> Done;
    /// Brings all outputs to their safe state immediately.
    fn safe_state(&mut self);
    /// Declares, with `host.safe_handle`, the bytes that the guard writes after this process has exited; called once after `open`.
    fn handles(&mut self, _host: &mut Host) -> Done {
        Ok(())
    }
    /// Returns the object that carries out the declared services; called once after `make`.
    fn services(&self) -> Option<Arc<dyn Services>> {
        None
    }
    /// Searches for devices that could be opened, as defined by the options, without moving anything, and reports them with `host.found`.
    fn scan(_host: &mut Host) -> Done {
        Ok(())
    }
}

/// Services of a driver, called from another thread while the driver exchanges. State shared with the driver must be atomic, or protected
/// by a lock that `read` and `write` only try to take.
pub trait Services: Send + Sync {
    /// Carries out a service. Its arguments are read like options, and its answer is set with `host.answer`.
    fn serve(&self, service: &str, host: &mut Host) -> Done;
}

/// Memory of a driver, all zeros before the driver is created. One half belongs to the cycle, the other to the threads of services.
struct Place<T> {
    cycle: Cycle<T>,
    /// Object that carries out services, or null.
    services: *mut Arc<dyn Services>,
}

struct Cycle<T> {
    driver: *mut T,
    cause: *mut c_char,
}

thread_local! {
    /// Cause of a failed service or scan, read before its thread makes another call.
    static TOLD: RefCell<CString> = RefCell::default();
}

impl<T: Driver> Cycle<T> {
    unsafe fn at<'a>(memory: *mut c_void) -> &'a mut Cycle<T> {
        // SAFETY: the host passes memory of the declared size, and to one call at a time except for services.
        unsafe { &mut (*memory.cast::<Place<T>>()).cycle }
    }

    /// Returns the driver; `None` if it was not created or is closed.
    fn driver(&mut self) -> Option<&mut T> {
        // SAFETY: the pointer is null or from `make`.
        unsafe { self.driver.as_mut() }
    }

    /// Converts a result to its cause, which is valid until the next cause.
    fn cause(&mut self, done: Done) -> Cause {
        let Err(why) = done else { return std::ptr::null() };
        self.forget();
        self.cause = c_text(&why).into_raw();
        self.cause
    }

    fn forget(&mut self) {
        if !self.cause.is_null() {
            // SAFETY: the pointer is from `cause`.
            drop(unsafe { CString::from_raw(std::mem::replace(&mut self.cause, std::ptr::null_mut())) });
        }
    }
}

/// Converts the result of a call outside the cycle to its cause.
fn told(done: Done) -> Cause {
    let Err(why) = done else { return std::ptr::null() };
    TOLD.with_borrow_mut(|told| {
        *told = c_text(&why);
        told.as_ptr()
    })
}

unsafe extern "C" fn make<T: Driver>(memory: *mut c_void, host: *mut abi::Host) -> Cause {
    // SAFETY: see `Cycle::at`, here and below; no service is called before the driver is made.
    let (place, services) = unsafe { (Cycle::<T>::at(memory), &raw mut (*memory.cast::<Place<T>>()).services) };
    let made = T::make(&mut Host(host)).map(|driver| {
        if let Some(beside) = driver.services() {
            // SAFETY: as above.
            unsafe { *services = Box::into_raw(Box::new(beside)) };
        }
        place.driver = Box::into_raw(Box::new(driver));
    });
    place.cause(made)
}

unsafe extern "C" fn open<T: Driver>(memory: *mut c_void, now_ns: i64) -> Cause {
    let place = unsafe { Cycle::<T>::at(memory) };
    let opened = place.driver().map_or(Ok(()), |driver| driver.open(now_ns));
    place.cause(opened)
}

unsafe extern "C" fn read<T: Driver>(memory: *mut c_void, release_ns: i64, readings: *mut u8) -> Cause {
    let place = unsafe { Cycle::<T>::at(memory) };
    let done = place.driver().map_or(Ok(()), |driver| driver.read(release_ns, Readings(readings)));
    place.cause(done)
}

unsafe extern "C" fn write<T: Driver>(memory: *mut c_void, release_ns: i64, commands: *const u8, engaged: *const u8) -> Cause {
    let place = unsafe { Cycle::<T>::at(memory) };
    let done = place.driver().map_or(Ok(()), |driver| driver.write(release_ns, Commands(commands, engaged)));
    place.cause(done)
}

unsafe extern "C" fn taken<T: Driver>(memory: *mut c_void) -> i64 {
    let place = unsafe { Cycle::<T>::at(memory) };
    place.driver().and_then(|driver| driver.taken_ns()).unwrap_or(i64::MIN)
}

unsafe extern "C" fn safe_state<T: Driver>(memory: *mut c_void) {
    if let Some(driver) = unsafe { Cycle::<T>::at(memory) }.driver() {
        driver.safe_state();
    }
}

unsafe extern "C" fn close<T: Driver>(memory: *mut c_void) {
    let place = unsafe { Cycle::<T>::at(memory) };
    if !place.driver.is_null() {
        // SAFETY: the pointer is from `make`, and is taken once.
        drop(unsafe { Box::from_raw(std::mem::replace(&mut place.driver, std::ptr::null_mut())) });
    }
    place.forget();
    // SAFETY: the host no longer calls services, and a pointer that is not null is from `make`.
    unsafe {
        let services = std::mem::replace(&mut (*memory.cast::<Place<T>>()).services, std::ptr::null_mut());
        if !services.is_null() {
            drop(Box::from_raw(services));
        }
    }
}

unsafe extern "C" fn handles<T: Driver>(memory: *mut c_void, host: *mut abi::Host) -> Cause {
    let place = unsafe { Cycle::<T>::at(memory) };
    let done = place.driver().map_or(Ok(()), |driver| driver.handles(&mut Host(host)));
    place.cause(done)
}

unsafe extern "C" fn serve<T: Driver>(memory: *mut c_void, host: *mut abi::Host, name: *const c_char) -> Cause {
    // SAFETY: only `make` and `close` write the pointer, and neither is called concurrently with a service.
    let services = unsafe { (*memory.cast::<Place<T>>()).services.as_ref() };
    // SAFETY: the host passes a text.
    let name = unsafe { abi::text(name) };
    told(services.map_or_else(|| Err(format!("it carries out no service '{name}'")), |services| services.serve(&name, &mut Host(host))))
}

unsafe extern "C" fn scan<T: Driver>(host: *mut abi::Host) -> Cause {
    told(T::scan(&mut Host(host)))
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
        handles: Some(handles::<T>),
        service: Some(serve::<T>),
        scan: T::SCANS.then_some(scan::<T>),
        taken: Some(taken::<T>),
    }))
}

/// Returns the declaration of a file that contains this driver.
pub fn file<T: Driver>() -> *const Module {
    let drivers: &'static [unsafe extern "C" fn() -> *const abi::Driver] = Box::leak(Box::new([table::<T> as unsafe extern "C" fn() -> _]));
    let size = size_of::<Module>() as u32;
    Box::leak(Box::new(Module { abi: abi::ABI, size, drivers: drivers.as_ptr(), count: 1, reserved: 0, target: c"".as_ptr(), compiler: c"rustc".as_ptr() }))
}

/// Exports a driver from its crate: `export!(Axis);`.
#[macro_export]
macro_rules! export {
    ($driver:ty) => {
        #[unsafe(no_mangle)]
        pub extern "C" fn opengpac_driver_file() -> *const $crate::abi::Module {
            $crate::opengpac_driver::file::<$driver>()
        }
    };
}
