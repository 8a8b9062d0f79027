// SPDX-License-Identifier: Apache-2.0
//! An emulated EtherCAT segment: drives and terminals on a line, as a main device sees them through their frames.
//!
//! | | |
//! |---|---|
//! | [`Segment`] | the line: passes a frame through all subdevices, loses and corrupts frames, cuts cables, switches drives off |
//! | `controller` | the memory of a subdevice: registers, SyncManagers, FMMUs, EEPROM |
//! | `clock` | its distributed clock, with SYNC0 |
//! | `subdevice` | its states |
//! | `terminal` | inputs and outputs, if it is not a drive |
//! | `identity`, `sdo` | its self-description, and the mailbox through which its objects are read and written |
//! | [`serve`] | answers the frames of an interface, in a thread or as a process |
mod clock;
mod controller;
mod identity;
mod options;
mod sdo;
mod segment;
mod serve;
mod subdevice;
mod terminal;

pub use cia402::emulated::{PRODUCT, VENDOR};
pub use options::{DriveOptions, TerminalOptions};
pub use segment::{Counts, Segment};
pub use serve::{Server, run, serve, serve_at};
pub use subdevice::SyncHistory;
