// SPDX-License-Identifier: Apache-2.0
//! An emulated CANopen bus: CiA 402 drives and CiA 401 modules, as a controller sees them through their frames.
//!
//! | | |
//! |---|---|
//! | [`Bus`] | the line: passes, loses and corrupts frames, switches drives off, makes them fail |
//! | `node` | a node: its states, heartbeat, process data; its axis is `cia402`'s |
//! | `terminals` | the inputs and outputs of a module |
//! | `server` | the SDO server through which its objects are read and written |
//! | [`SharedBus`], [`publish`] | a bus of this process, accessible by its name |
//! | [`serve`] | answers on a local socket or an interface, in a thread or as a process |
mod bus;
mod machine;
mod node;
mod objects;
mod said;
mod serve;
mod server;
mod terminals;
mod within;

pub use bus::Bus;
pub use said::{NodeOptions, Terminals};
pub use serve::{Server, run, serve};
pub use within::{SharedBus, Within, publish, published};
