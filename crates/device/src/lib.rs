// SPDX-License-Identifier: Apache-2.0
//! Driver interface: the layer between a physical device and the kernel that reads and writes it.
//!
//! | | |
//! |---|---|
//! | [`Driver`], [`DeviceError`] | functions of a driver: open, read, write, safe state, close |
//! | [`Channel`], [`Direction`], [`Type`] | description of its values |
//! | [`Layout`], [`Slot`] | location of its values: computed offsets |
//! | [`Declaration`], [`OptionWord`], [`Class`] | its manual: name, options with units and defaults, thread of its exchange |
//! | [`register`], [`open`], [`geometry`] | the drivers of this process: each registers itself, no higher layer names one |
//! | [`DriverMaker`], [`lend_loader`] | drivers from a file: `name@file.so` |
//! | [`GivenOptions`] | options, checked in one place |
//! | [`Life`], [`SafeState`] | opening, loss and safe state of its device |
//! | [`Services`], [`ServiceWord`], [`Scan`] | functions off the cycle: commands, and the search for devices |
//! | [`Counters`] | its counters: lost frames, late responses |
//! | [`Beside`], [`Manual`] | services and counters of an open driver; its declaration in a format that can be sent and printed |
//! | [`Part`], [`Command`], [`Servo`], [`Geometry`] | description of its machine, and its appearance |
//! | [`Attendance`] | silence of the other side, counted only while this side was running |
//! | [`SafeHandle`] | writes that the guard makes when the driver's process has exited |
//!
//! This crate is independent of kernels, verbs, threads and processes.
mod accepted;
mod attendance;
mod channel;
mod class;
mod counters;
pub mod counts;
mod declaration;
mod driver;
mod driver_services;
mod error;
mod factory;
mod layout;
mod learned;
mod lent;
mod life;
mod loaded;
mod manual;
mod nested;
mod opening;
mod option_check;
mod option_word;
mod options;
mod part;
mod ranges;
mod reach;
mod registry;
mod safe_handle;
mod services;
mod shapes;
mod types;
mod watchdog;
mod worker;

pub use accepted::options_of;
pub use attendance::Attendance;
pub use channel::{Channel, Direction};
pub use class::Class;
pub use counters::{CounterWord, Counters};
pub use declaration::{Declaration, Of, StandIn};
pub use driver::Driver;
pub use driver_services::{Beside, ServiceError};
pub use error::{DeviceError, DriverError};
pub use factory::{UNGUARDED_WITHOUT_GUARD, check, geometry, in_virtual_time, open, scan, try_options};
pub use layout::{Layout, Slot};
pub use learned::DeclaredServices;
pub use lent::{interpreter, lend_interpreter};
pub use life::{Life, SafeBy, SafeState};
pub use loaded::{Loader, lend_loader, load};
pub use manual::{CounterAbout, Manual, OptionAbout, SafeStateAbout, ServiceAbout};
pub use opening::{DriverMaker, OpenedDriver};
pub use option_check::check_service;
pub use option_word::{Inside, Kind, OptionWord, Reach};
pub use options::GivenOptions;
pub use part::{Command, Part, Servo, UNLIMITED};
pub use reach::{ReachingValue, each_reach, each_reach_of_service};
pub use registry::{declarations, find, register};
pub use safe_handle::SafeHandle;
pub use services::{FoundDevice, Scan, ServiceWord, Services, under_a_stop};
pub use shapes::{Body, Geometry, Joint, JointKind, Mesh, Shape};
pub use types::{Number, Type};
pub use watchdog::timeout_message;
pub use worker::{Pace, Worker, lend_worker};
