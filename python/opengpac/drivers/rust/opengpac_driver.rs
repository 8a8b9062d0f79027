// SPDX-License-Identifier: Apache-2.0
//! A driver in Rust, as `opengpac_driver.h` has it in C: a struct with the trait [`Driver`], and [`export`] once in its crate. What it promises is
//! what that header says: `read` and `write` are bounded and neither allocate, lock nor wait, unless its items have `worker()`.
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

/// Result of a driver's function: nothing, or the cause for people.
pub type Done = Result<(), String>;

pub trait Driver: Sized + Send {
    const NAME: &'static CStr;
    const DOC: &'static CStr;
    /// Its manual: options, safe state, counters, services.
    const ITEMS: &'static [Item];
    /// True if it looks for devices, by [`Driver::scan`].
    const SCANS: bool = false;

    /// Channels and parts, from the options. Nothing of the machine is touched.
    fn make(host: &mut Host) -> Result<Self, String>;
    /// Connects to the machine, once before the first exchange.
    fn open(&mut self, _now_ns: i64) -> Done {
        Ok(())
    }
    /// Reads, at the start of each firing. An error means that the device is lost.
    fn read(&mut self, release_ns: i64, readings: Readings) -> Done;
    /// Returns, after each `read`, when the machine took its readings, on the clock of `release_ns`. One that has heard nothing new answers the time
    /// from
    /// before, and the channel `age` of its device grows. Left out: with the read.
    fn taken_ns(&self) -> Option<i64> {
        None
    }
    /// Writes, at the end of each firing.
    fn write(&mut self, release_ns: i64, commands: Commands) -> Done;
    /// Brings all outputs to their safe state now.
    fn safe_state(&mut self);
    /// Declares, once behind `open`, what the guard writes when this process is gone, by `host.safe_handle`.
    fn handles(&mut self, _host: &mut Host) -> Done {
        Ok(())
    }
    /// Returns, once behind `make`, what carries out the services of its items.
    fn services(&self) -> Option<Arc<dyn Services>> {
        None
    }
    /// Looks for devices that its options could open, and moves nothing: `host.found`.
    fn scan(_host: &mut Host) -> Done {
        Ok(())
    }
}

/// Services of a driver, called from another thread while the driver exchanges. What it shares with the driver is atomic, or locked where `read` and
/// `write` only try.
pub trait Services: Send + Sync {
    /// Carries out a service; its arguments are asked for as options are, and its answer is `host.answer`.
    fn serve(&self, service: &str, host: &mut Host) -> Done;
}

/// The memory of a driver; all 0 before it is made. The cycle has one half, the threads of services the other.
struct Place<T> {
    cycle: Cycle<T>,
    /// Null, or what carries out services.
    services: *mut Arc<dyn Services>,
}

struct Cycle<T> {
    driver: *mut T,
    cause: *mut c_char,
}

thread_local! {
    /// The cause of a service or a scan, which is read before its thread calls another.
    static TOLD: RefCell<CString> = RefCell::default();
}

impl<T: Driver> Cycle<T> {
    unsafe fn at<'a>(memory: *mut c_void) -> &'a mut Cycle<T> {
        // SAFETY: the host gives memory of the size that was declared; but for services, to one call at a time.
        unsafe { &mut (*memory.cast::<Place<T>>()).cycle }
    }

    /// Returns the driver; none: it was not made, or is closed.
    fn driver(&mut self) -> Option<&mut T> {
        // SAFETY: null, or from `make`.
        unsafe { self.driver.as_mut() }
    }

    /// Returns the cause, which stays until the next one.
    fn cause(&mut self, done: Done) -> Cause {
        let Err(why) = done else { return std::ptr::null() };
        self.forget();
        self.cause = c_text(&why).into_raw();
        self.cause
    }

    fn forget(&mut self) {
        if !self.cause.is_null() {
            // SAFETY: it is from `cause`.
            drop(unsafe { CString::from_raw(std::mem::replace(&mut self.cause, std::ptr::null_mut())) });
        }
    }
}

/// Returns the cause of what is not the cycle's.
fn told(done: Done) -> Cause {
    let Err(why) = done else { return std::ptr::null() };
    TOLD.with_borrow_mut(|told| {
        *told = c_text(&why);
        told.as_ptr()
    })
}

unsafe extern "C" fn make<T: Driver>(memory: *mut c_void, host: *mut abi::Host) -> Cause {
    // SAFETY: see `Cycle::at`, here and below; no service is called before it is made.
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
        // SAFETY: it is from `make`, and taken once.
        drop(unsafe { Box::from_raw(std::mem::replace(&mut place.driver, std::ptr::null_mut())) });
    }
    place.forget();
    // SAFETY: the host calls no service any more, and what is not null is from `make`.
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
    // SAFETY: only `make` and `close` write it, and neither is called beside a service.
    let services = unsafe { (*memory.cast::<Place<T>>()).services.as_ref() };
    // SAFETY: a name is a text.
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

/// Returns the declaration of a file with this driver.
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
