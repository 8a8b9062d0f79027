// SPDX-License-Identifier: Apache-2.0
//! The kernel, which runs on every real-time processor (RTP): interrupts, context switching, dispatch.
//!
//! It knows tables, connections and reactions, but no verbs, Python, JSON or files. The supervisor prepares everything that the kernel
//! runs, off the real-time path: a [`Table`] of steps for each interrupt source, [`Script`]s that change what is active between two
//! firings, and [`Process`]es whose watches map conditions to scripts.
//!
//! A firing of a source, in order: latch connections, read devices, run the steps that are due, write devices, publish connections, serve
//! conditions. On that path: no lock, allocation, system call (except one wake), hash look-up or page fault.
//!
//! `firing` is that path, `steps` its hot loop; `conditions` serves conditions, and `boundary` carries out changes between two firings.
//! The threads and clocks that drive the kernel, remote sources and records are in crate `runtime`.
#![cfg_attr(rtsan, feature(sanitize))]
mod bank;
pub mod bell;
pub mod block;
mod boundary;
mod charge;
pub mod clock;
mod conditions;
pub mod connection;
mod connection_identity;
pub mod containment;
pub mod copies;
pub mod counters;
mod device;
mod device_state;
pub mod edge;
pub mod event;
pub mod firing;
pub mod floats;
mod forcing;
mod fusing;
mod hearing;
pub mod inbound;
pub mod memory;
pub mod phase;
pub mod preempt;
pub mod probe;
pub mod process;
pub mod process_word;
pub mod rows;
pub mod running_time;
pub mod schedule;
pub mod script;
mod service;
pub mod serving;
pub mod shared;
pub mod source;
pub mod stamped;
mod standstill;
pub mod state;
pub mod step;
pub mod steps;
pub mod table;
pub mod tape;
mod visits;
pub mod window;

pub use self::device::Device;
pub use block::{Block, BlockId};
pub use connection::{End, row_prefix};
pub use connection_identity::{Nowhere, Reach, Way};
pub use containment::{BLACK_BOX_LEN, OUTSIDE as NO_STEP, RETIRED, retire_when_lost};
pub use counters::Statistics;
pub use device_state::{Ask, Asking, DeviceCall, DeviceStanding};
pub use edge::{Edge, Number};
pub use event::{Event, Fault};
pub use forcing::{FORCED_LEN_MAX, forced_word};
pub use memory::{Cell, Extent};
pub use phase::STAMP_LEN;
pub use probe::BlockTimes;
pub use process::{Home, Process, Reaction, RemoteWord, Response, Stage, TakeResult, Watch};
pub use rows::RowsEnd;
pub use schedule::{Activation, Due, Inbound, Outbound, QueueMember};
pub use script::{Inheritance, Op, Reopening, Script};
pub use service::{LatestReading, Service, View};
pub use source::{SourceId, SourceKind, SourceSpec};
pub use stamped::{NEVER_NS, StampedValue, unstamped};
pub use step::{Append, Rows, Step, StepKind};
pub use table::Table;
pub use tape::Occasion;
pub use window::Window;
