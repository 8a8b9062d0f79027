// SPDX-License-Identifier: Apache-2.0
//! Memory layout shared by a driver in C and this system, as declared in `opengpac_driver.h`; a test compares the two.
use std::ffi::{c_char, c_void};

/// Version of this layout.
pub const ABI: u32 = 1;
/// Name of the function that a file with drivers exports.
pub const SYMBOL: &str = "opengpac_driver_file";

/// Kinds of items of a declaration.
pub mod what {
    pub const OPTION: u32 = 1;
    pub const CLASS: u32 = 2;
    pub const WAITS: u32 = 3;
    pub const LOST_WITHIN: u32 = 4;
    pub const SAFE: u32 = 5;
    pub const COUNTER: u32 = 6;
    pub const RIGHT: u32 = 7;
    pub const SERVICE: u32 = 8;
}

/// Kinds of values.
pub mod kind {
    pub const NOTHING: u32 = 0;
    pub const NUMBER: u32 = 1;
    pub const WHOLE: u32 = 2;
    pub const BOOL: u32 = 3;
    pub const TEXT: u32 = 4;
    pub const LIST: u32 = 5;
    pub const TABLE: u32 = 6;
}

/// Classes of a driver's exchange.
pub mod class {
    pub const INLINE: u32 = 0;
    pub const WORKER: u32 = 1;
}

/// Agents that bring a device to its safe state.
pub mod by {
    pub const DRIVER: u32 = 1;
    pub const GUARD: u32 = 2;
    pub const DEVICE: u32 = 4;
    pub const END: u32 = 8;
}

/// Cause of a failure; null after success.
pub type Cause = *const c_char;

#[derive(Clone, Copy)]
#[repr(C)]
pub struct Item {
    pub what: u32,
    pub kind: u32,
    pub name: *const c_char,
    pub doc: *const c_char,
    pub unit: *const c_char,
    pub text: *const c_char,
    pub number: f64,
    pub whole: i64,
    pub needed: u32,
    pub by: u32,
}

#[derive(Clone, Copy, Default)]
#[repr(C)]
pub struct Slot {
    pub offset: u32,
    pub index: u32,
}

#[repr(C)]
pub struct Channel {
    pub size: u32,
    pub is_written: u32,
    pub name: *const c_char,
    pub type_text: *const c_char,
    pub doc: *const c_char,
    pub unit: *const c_char,
    pub safe: f64,
    pub slew_max: f64,
}

#[repr(C)]
pub struct Part {
    pub size: u32,
    pub is_slide: u32,
    pub by_position: u32,
    pub reserved: u32,
    pub name: *const c_char,
    pub range_min: f64,
    pub range_max: f64,
    pub effort_max: f64,
    pub speed_max: f64,
    pub home: f64,
    pub kp: f64,
    pub kd: f64,
}

#[repr(C)]
pub struct Handle {
    pub size: u32,
    pub latches: u32,
    pub descriptor: i32,
    pub length: u32,
    pub offset: u64,
    pub bytes: *const c_void,
}

#[repr(C)]
pub struct Host {
    pub abi: u32,
    pub size: u32,
    pub at: *mut c_void,
    pub number: unsafe extern "C" fn(*mut Host, *const c_char) -> f64,
    pub whole: unsafe extern "C" fn(*mut Host, *const c_char) -> i64,
    pub text: unsafe extern "C" fn(*mut Host, *const c_char) -> *const c_char,
    pub json: unsafe extern "C" fn(*mut Host, *const c_char) -> *const c_char,
    pub length: unsafe extern "C" fn(*mut Host, *const c_char) -> i64,
    pub number_at: unsafe extern "C" fn(*mut Host, *const c_char, i64) -> f64,
    pub text_at: unsafe extern "C" fn(*mut Host, *const c_char, i64) -> *const c_char,
    pub channel: unsafe extern "C" fn(*mut Host, *const Channel) -> Slot,
    pub part: unsafe extern "C" fn(*mut Host, *const Part),
    pub counter: unsafe extern "C" fn(*mut Host, *const c_char) -> *mut u64,
    pub watchdog: unsafe extern "C" fn(*mut Host, i64),
    pub handle: unsafe extern "C" fn(*mut Host, *const Handle),
    pub answer: unsafe extern "C" fn(*mut Host, *const c_char),
    pub found: unsafe extern "C" fn(*mut Host, *const c_char, *const c_char),
}

#[derive(Clone, Copy)]
#[repr(C)]
pub struct Driver {
    pub size: u32,
    pub line: u32,
    pub name: *const c_char,
    pub doc: *const c_char,
    pub file: *const c_char,
    pub items: *const Item,
    pub item_size: u32,
    pub item_count: u32,
    pub instance_size: u64,
    pub make: Option<unsafe extern "C" fn(*mut c_void, *mut Host) -> Cause>,
    pub open: Option<unsafe extern "C" fn(*mut c_void, i64) -> Cause>,
    pub read: Option<unsafe extern "C" fn(*mut c_void, i64, *mut u8) -> Cause>,
    pub write: Option<unsafe extern "C" fn(*mut c_void, i64, *const u8, *const u8) -> Cause>,
    pub safe_state: Option<unsafe extern "C" fn(*mut c_void)>,
    pub close: Option<unsafe extern "C" fn(*mut c_void)>,
    pub handles: Option<unsafe extern "C" fn(*mut c_void, *mut Host) -> Cause>,
    pub service: Option<unsafe extern "C" fn(*mut c_void, *mut Host, *const c_char) -> Cause>,
    pub scan: Option<unsafe extern "C" fn(*mut Host) -> Cause>,
    /// Returns the time of the readings; `i64::MIN` represents the time of the read. In drivers built before this field existed, the
    /// structure ends before it.
    pub taken: Option<unsafe extern "C" fn(*mut c_void) -> i64>,
}

#[repr(C)]
pub struct Module {
    pub abi: u32,
    pub size: u32,
    pub drivers: *const unsafe extern "C" fn() -> *const Driver,
    pub count: u32,
    pub reserved: u32,
    pub target: *const c_char,
    pub compiler: *const c_char,
}

/// Returns the text at an address; empty if the address is null.
///
/// # Safety
/// The address must be null or point to a NUL-terminated text.
pub unsafe fn text(at: *const c_char) -> String {
    if at.is_null() {
        return String::new();
    }
    // SAFETY: the address is not null, and the caller guarantees that its text ends with a 0.
    unsafe { std::ffi::CStr::from_ptr(at) }.to_string_lossy().into_owned()
}
