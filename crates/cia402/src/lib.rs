// SPDX-License-Identifier: Apache-2.0
//! Drives by CiA 402, on any bus: EtherCAT carries the same objects as CANopen.
//!
//! | | |
//! |---|---|
//! | [`DriveState`], [`Mode`], [`error_name`] | states, modes, errors by name |
//! | [`Commander`], [`Brake`], [`Homing`] | the command side: control words and targets without jumps, and without a falling load |
//! | [`axis`] | an axis of a driver: its options, its channels, its services |
//! | [`identity`] | identification of the device at a location on a bus, and check that it is the right one |
//! | [`Entry`], [`abort_name`] | an object's entry, and reasons why a device refuses an access to it |
//! | [`emulated`] | an emulated drive: its objects, its state machine, and a motor that follows; the server of a bus of them |
//!
//! This crate does not depend on a bus.
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
