// SPDX-License-Identifier: Apache-2.0
//! An axis of a driver, on whatever bus: a driver adds where its drive is and how bytes come and go.
//!
//! | | |
//! |---|---|
//! | [`AxisOptions`], [`check`] | how an axis is asked for, and what is refused |
//! | [`Axis`] | its channels and what its drive is told |
//! | [`Homes`], [`HomingProgress`] | homing: what the service asks of the cycle, and how it waits |
//! | [`ServiceState`], [`Reach`] | services beside the cycle: objects, faults, homing |
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
