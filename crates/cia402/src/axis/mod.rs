// SPDX-License-Identifier: Apache-2.0
//! An axis of a driver, on any bus. A driver adds the address of its drive and the transport of bytes.
//!
//! | | |
//! |---|---|
//! | [`AxisOptions`], [`check`] | options of an axis, and their refusals |
//! | [`Axis`] | its channels and the commands to its drive |
//! | [`Homes`], [`HomingProgress`] | homing: the service's requests to the cycle, and its wait |
//! | [`ServiceState`], [`Reach`] | services outside the cycle: object dictionary access, fault reset, homing |
//! | [`held`] | objects that are not written while an emergency stop is latched |
mod channels;
mod homing;
mod moved;
mod options;
#[cfg(test)]
mod overtaken;
mod services;
mod stopped;

pub use channels::part;
pub use homing::{HOME, Homes, HomingProgress, ServiceStart};
pub use moved::{Axis, DriveReadings};
pub use options::{AxisOptions, CommandKind, FIELDS, IDENTITY, Unit, check, unknown};
pub use services::{AXIS, READ_OBJECT, RESET_FAULT, Reach, ServiceState, WRITE_OBJECT, entry, is_told_of_stops};
pub use stopped::held;
