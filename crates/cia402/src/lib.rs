// SPDX-License-Identifier: Apache-2.0
//! Drives by CiA 402, whatever bus they hang on: EtherCAT carries the same objects as CANopen.
//!
//! | | |
//! |---|---|
//! | [`DriveState`], [`Mode`], [`error_name`] | states, modes, errors by name |
//! | [`Commander`], [`Brake`], [`Homing`] | the side that commands one: control words and targets, nothing leaps, no load falls |
//! | [`axis`] | an axis of a driver: its options, its channels, its services |
//! | [`identity`] | which device answers at a place on a bus, and whether it is the right one |
//! | [`Entry`], [`abort_name`] | an object's entry, and why a device refuses an access to it |
//! | [`emulated`] | an emulated drive: its objects, its state machine, and a motor that follows; what serves a bus of them |
//!
//! Nothing here knows a bus.
pub mod axis;
mod brake;
mod commander;
pub mod emulated;
mod homing;
pub mod identity;
mod objects;
mod states;

pub use brake::{Brake, BrakeOptions};
pub use commander::{Commander, DriveCommand, Scale};
pub use homing::{Homing, HomingState, HomingStep};
pub use objects::{Entry, abort_name};
pub use states::{DISABLE_VOLTAGE, DriveState, ENABLE, Mode, QUICK_STOP, RESET, SHUT_DOWN, SWITCH_ON, error_name};
