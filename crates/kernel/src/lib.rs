// SPDX-License-Identifier: Apache-2.0
//! The kernel: what runs on every real-time processor (RTP). Interrupts, context switching, dispatch.
//!
//! It knows tables, connections and reactions; no verb, Python, JSON or file. Everything that it runs was prepared off the
//! real-time path by the supervisor: a [`Table`] of steps for each interrupt source, [`Script`]s that change what is active
//! between two firings, and the [`Process`]es whose watches say which script answers which condition.
//!
//! A firing of a source, in order: latch connections, read devices, run the steps that are due, write devices, publish
//! connections, serve conditions. On that path: no lock, allocation, system call (but one wake), hash look-up or page fault.
//!
//! `firing` is that path, `steps` its hot loop, `conditions` what answers, `boundary` what changes between two firings; `thread`
//! and `virtual_clock` are the two ways to drive it.
#![cfg_attr(rtsan, feature(sanitize))]
mod abroad;
pub mod block;
mod boundary;
pub mod clock;
mod conditions;
pub mod connection;
pub mod device;
pub mod edge;
pub mod event;
pub mod far;
mod firing;
mod futex;
mod guard;
pub mod heritage;
pub mod host;
pub mod memory;
mod preempt;
pub mod probe;
pub mod process;
mod relay;
mod rights;
mod sandbox;
pub mod schedule;
pub mod script;
pub mod source;
pub mod stamped;
mod steps;
pub mod table;
pub mod tape;
mod thread;
pub mod trace;
mod virtual_clock;
mod watchdog;
pub mod window;
pub mod wire;

pub use block::{Block, BlockId};
pub use clock::ClockKind;
pub use connection::{End, Inbound, Outbound, QueueMember, RowsEnd, row_prefix};
pub use device::{Ask, Channel, Device, DeviceCall, DeviceError, DeviceState, Direction, Driver, Renewal, Retired, SafeHandle};
pub use edge::{Edge, Number};
pub use event::{Event, Fault};
pub use far::{Far, Reach, Way};
pub use guard::{BLACK_BOX_LEN, OUTSIDE as NO_STEP};
pub use heritage::{Heritage, Holding, Passed};
pub use host::Host;
pub use memory::{Cell, Extent};
pub use probe::BlockTimes;
pub use process::{Process, Response, Stage, Taken, Watch};
pub use rights::{may_lock_all, take_for_supervisor};
pub use sandbox::Sandbox;
pub use schedule::{Activation, Due, STAMP_LEN};
pub use script::{Op, Script};
pub use source::{SourceId, SourceKind, SourceSpec, Statistics};
pub use stamped::{NEVER_NS, Stamped, unstamped};
pub use table::{Append, Rows, Step, StepKind, Table};
pub use tape::{Occasion, Stretch};
pub use window::Window;
