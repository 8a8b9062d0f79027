// SPDX-License-Identifier: Apache-2.0
//! A bus of CANopen that is only a program: drives by CiA 402, as a controller sees them through its frames.
//!
//! | | |
//! |---|---|
//! | [`Bus`] | the line: passes frames, loses and spoils them, switches drives off, makes them fail |
//! | `node` | a node: its states, heartbeat, process data; its axis is `cia402`'s |
//! | `server` | the SDO server through which its objects are read and written |
//! | [`serve`] | answers on a local socket or an interface, in a thread or as a process |
mod bus;
mod node;
mod objects;
mod said;
mod serve;
mod server;

pub use bus::Bus;
pub use said::DriveOptions;
pub use serve::{Server, run, serve};
