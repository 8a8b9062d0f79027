// SPDX-License-Identifier: Apache-2.0
//! Layers above the kernel: hosts, the threads and clocks that drive the kernel, remote sources and relays between them, records of a
//! run, and the handover from one host to the next.
//!
//! A [`Host`] contains the kernels of one process: a `thread` for each source under the monotonic clock, or one `virtual_clock` for all
//! of them. `remote_sources` represents sources in other processes and on other hosts, `spread` serves processes that span several of
//! these locations, `encoding` encodes scripts sent there, `trace` records a run, and `heritage` lets a host take over from the previous
//! one.
mod clock;
pub mod encoding;
mod groups;
mod heir;
mod heritage;
mod host;
mod locked;
mod relay;
mod reminder;
mod remote;
pub mod remote_device;
mod remote_sources;
mod renewal;
mod rights;
mod sandbox;
mod spread;
mod thread;
pub mod trace;
mod virtual_clock;
mod waiting;
mod watchdog;

pub use clock::ClockKind;
pub use groups::{Group, groups};
pub use heir::{heir, open_seen};
pub use heritage::{CarriedBlocks, Heritage, Holding};
pub use host::{Change, Host, PlayedSegment};
pub use remote::Remote;
pub use remote_device::DeviceState;
pub use renewal::{Renewal, RetiredDriver};
pub use rights::{take_for_heart, take_for_supervisor};
pub use sandbox::Sandbox;
pub use trace::Stretch;
pub use waiting::waits_for_a_core;
