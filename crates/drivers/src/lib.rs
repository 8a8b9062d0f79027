// SPDX-License-Identifier: Apache-2.0
//! Drivers included in OpenGPAC: physical devices behind the interface of crate [`device`].
//!
//! Each driver is a file or a folder here, with a declaration that names its options; `ALL` lists them. A driver depends only on channels
//! and time, not on verbs, state vector variables or Python, and no higher layer names it: it is requested by a string. A driver of
//! another crate calls [`device::register`], and is requested in the same way.
//!
//! | kind | description |
//! |---|---|
//! | `mujoco` | a robot arm simulated by MuJoCo, from any MJCF file |
//! | `loopback` | parts that follow their effort, `x' = u`, for tests; it can fail on purpose |
//! | `ethercat` | CiA 402 drives on EtherCAT, one axis each; its crate is `ethercat` |
//! | `canopen` | CiA 402 drives on CANopen, one axis each; its crate is `canopen` |
//! | `plant_process` | any of the others in a process of its own, at its own pace, which outlives the process that commands it |
//! | `feetech`, `dynamixel` | servos on a serial bus, each a joint that takes goals |
//! | `python` | a driver written in Python, in a process of its own |
//! | `modbus` | a Modbus device over TCP or a serial line |
//! | `modbus_server` | channels of this machine, offered over Modbus TCP |
//! | `text` | a device that communicates in lines of text, over TCP or a serial line |
//! | `ur` | a Universal Robots arm over RTDE, which takes positions |
//! | `scripted` | channels of any type that read a table of values and record commands, for tests |
mod loopback;
mod modbus;
mod mujoco;
mod plant_process;
mod scripted;
mod serial;
mod servos;
mod stream;
mod text;
mod ur;

/// Parsers of bytes received from machines, for fuzzers: functions that take arbitrary bytes, and panic if accepted bytes would be
/// encoded differently.
#[doc(hidden)]
pub mod any_bytes {
    pub use crate::modbus::any_bytes::modbus;
    pub use crate::servos::any_bytes::servos;
    pub use crate::text::any_bytes::text;
    pub use crate::ur::any_bytes::rtde;
}

use device::{Declaration, DriverError, FoundDevice, Geometry, Manual, OpenedDriver, ReachingValue};
pub use driver_kit::conformance::{Outcome, Report, Settings, sanitizer_in};
use serde_json::Value;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Once;

pub use plant_process::{PlantState, clean as clean_processes, state as process_state};

/// All drivers of this crate.
#[rustfmt::skip]
static ALL: &[&Declaration] = &[
    &mujoco::DRIVER,
    &ethercat::DRIVER,
    &canopen::DRIVER,
    &loopback::DRIVER,
    &plant_process::DRIVER,
    &plant_process::PYTHON,
    &scripted::DRIVER,
    &modbus::DRIVER,
    &modbus::server::DRIVER,
    &text::DRIVER,
    &servos::FEETECH,
    &servos::DYNAMIXEL,
    &ur::DRIVER,
];

/// Registers this crate's drivers in this process. Idempotent.
fn register() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        driver_kit::lend();
        for driver in ALL {
            device::register(driver).unwrap_or_else(|taken| panic!("another driver has already taken a name of this crate: {taken}"));
        }
    });
}

/// Returns the registered drivers, including those of other crates, by name.
pub fn declarations() -> Vec<&'static Declaration> {
    register();
    device::declarations()
}

/// Returns the declaration of each registered driver, by name.
pub fn manuals() -> Vec<Manual> {
    declarations().into_iter().map(Manual::from).collect()
}

/// Searches for devices that a driver could open, like [`device::scan`].
///
/// # Errors
/// Fails if the kind is unknown or cannot search, or with the driver's own error.
pub fn scan(kind: &str, options: &Value) -> Result<Vec<FoundDevice>, DriverError> {
    register();
    device::scan(kind, options)
}

/// Creates the driver `kind` from its options, like [`device::open`].
///
/// # Errors
/// Fails if the kind is unknown or an option is wrong, or with the driver's own error.
pub fn open(kind: &str, options: &Value) -> Result<OpenedDriver, DriverError> {
    register();
    device::open(kind, options)
}

/// Returns the drivers in a file, like [`device::load`].
///
/// # Errors
/// Returns the problem with the file.
pub fn load(file: &Path) -> Result<Vec<&'static Declaration>, DriverError> {
    register();
    device::load(file)
}

/// Checks options against a declaration, like [`device::check`].
///
/// # Errors
/// Fails if the kind is unknown, or an option is wrong, unknown or missing.
pub fn check(kind: &str, options: &Value) -> Result<(), DriverError> {
    register();
    device::check(kind, options)
}

/// Returns the shapes of a driver's machine, like [`device::geometry`].
///
/// # Errors
/// Fails like [`open`].
pub fn geometry(kind: &str, options: &Value) -> Result<Option<Geometry>, DriverError> {
    register();
    device::geometry(kind, options)
}

/// Tries the files named by the options of a driver, like [`device::try_options`].
///
/// # Errors
/// Fails with a description of the problem found by the trial.
pub fn try_options(kind: &str, options: &Value) -> Result<(), DriverError> {
    register();
    device::try_options(kind, options)
}

/// Returns the driver that replaces another in virtual time, like [`device::in_virtual_time`].
pub fn in_virtual_time(kind: &str, options: &Value) -> (String, Value) {
    register();
    device::in_virtual_time(kind, options)
}

/// Visits each option that names a file or code, like [`device::each_reach`].
///
/// # Errors
/// Returns the first error of `visit`.
pub fn each_reach<E>(kind: &str, options: &mut Value, visit: &mut dyn FnMut(ReachingValue<'_>) -> Result<(), E>) -> Result<(), E> {
    register();
    device::each_reach(kind, options, visit)
}

/// Visits each argument of a service that names a file or code, like [`device::each_reach_of_service`].
///
/// # Errors
/// Returns the first error of `visit`.
pub fn each_reach_of_service<E>(
    of: (&str, &Value),
    service: &str,
    arguments: &mut Value,
    visit: &mut dyn FnMut(ReachingValue<'_>) -> Result<(), E>,
) -> Result<(), E> {
    register();
    device::each_reach_of_service(of, service, arguments, visit)
}

/// Runs a process that was started for a driver. Returns when the driver has been closed, or when no client has been connected for its
/// linger time.
///
/// # Errors
/// Fails with a human-readable message if the process was not started by a driver.
pub fn run_process() -> Result<(), String> {
    register();
    plant_process::run()
}

/// Checks a driver with the conformance kit; `settings` contain the command line of a process that calls [`run_check`]. `hear` receives
/// each outcome as it arrives, and can stop the checks by breaking.
pub fn check_conformance(kind: &str, options: &Value, settings: &Settings, hear: &mut dyn FnMut(&Outcome) -> ControlFlow<()>) -> Report {
    register();
    driver_kit::conformance::check(kind, options, settings, hear)
}

/// Runs a process in which a driver is checked.
///
/// # Errors
/// Fails with a human-readable message if the process was not started for this purpose.
pub fn run_check() -> Result<(), String> {
    register();
    driver_kit::conformance::serve()
}
