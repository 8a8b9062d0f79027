// SPDX-License-Identifier: Apache-2.0
//! CiA 402 drives, on any bus: EtherCAT uses the same objects as CANopen.
//!
//! | | |
//! |---|---|
//! | [`DriveState`], [`Mode`], [`error_name`] | states, modes, and names of errors |
//! | [`Commander`], [`Brake`], [`Homing`] | the command side: control words and targets, without setpoint jumps or dropped loads |
//! | [`axis`] | an axis of a driver: its options, channels and services |
//! | [`identity`] | identifies the device at a bus address, and checks that it is the expected one |
//! | [`Entry`], [`abort_name`] | an entry of an object, and the reasons for which a device may deny access to it |
//! | [`emulated`] | an emulated drive: its objects, its state machine and a motor that follows its targets; the server for a bus of such drives |
//!
//! This crate does not depend on any particular bus.
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
