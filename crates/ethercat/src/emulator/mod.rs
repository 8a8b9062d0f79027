// SPDX-License-Identifier: Apache-2.0
//! A segment of EtherCAT that is only a program: drives on a line, as a main device sees them through its frames.
//!
//! | | |
//! |---|---|
//! | [`Segment`] | the line: passes a frame through all of it, loses and spoils frames, cuts cables, switches drives off |
//! | `controller` | the memory of a subdevice: registers, SyncManagers, FMMUs, EEPROM, clock |
//! | `subdevice` | its states |
//! | `objects`, `sdo` | its objects, and the mailbox through which they are read and written |
//! | `drive` | its axis: the state machine and the modes of CiA 402, with a motor that follows |
//! | [`serve`] | answers the frames of an interface, in a thread or as a process |
mod controller;
mod drive;
mod objects;
mod sdo;
mod segment;
mod serve;
mod subdevice;

pub use drive::{PRODUCT, VENDOR};
pub use segment::{Counts, DriveOptions, Segment};
pub use serve::{Server, run, serve};
