// SPDX-License-Identifier: Apache-2.0
//! The interface of a driver: what stands between a physical device and the kernel that reads and writes it.
//!
//! | | |
//! |---|---|
//! | [`Driver`], [`DeviceError`] | what a driver does: open, read, write, safe state, close |
//! | [`Channel`], [`Direction`], [`Type`] | what it says of its values |
//! | [`Layout`], [`Slot`] | where they lie: offsets that nobody counts by hand |
//! | [`Declaration`], [`OptionWord`], [`Class`] | its manual: name, options with units and defaults, where it exchanges |
//! | [`register`], [`open`], [`geometry`] | the drivers of this process: each registers itself, nobody above names one |
//! | [`DriverMaker`], [`lend_loader`] | drivers that come in a file: `name@file.so` |
//! | [`GivenOptions`] | options, checked by one piece of code |
//! | [`Life`], [`SafeState`] | how its device comes, goes and comes to rest |
//! | [`Services`], [`ServiceWord`], [`Scan`] | what it does off the cycle: commands, and the search for devices |
//! | [`Counters`] | what it counts: lost frames, late answers |
//! | [`Beside`], [`Manual`] | services and counters of an open driver; what it declares, to be sent and printed |
//! | [`Part`], [`Command`], [`Servo`], [`Geometry`] | what it says of its machine, and what that looks like |
//! | [`Attendance`] | how long the other side was silent, as far as who judges it was there |
//! | [`SafeHandle`] | what the guard writes when the process of the driver is gone |
//!
//! Nothing here knows a kernel, a verb, a thread or a process.
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
