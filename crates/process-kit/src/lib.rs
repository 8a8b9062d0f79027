// SPDX-License-Identifier: Apache-2.0
//! Processes of one host: how they are started and how they end, and the link between two of them.
//!
//! | | |
//! |---|---|
//! | [`Launch`], [`Child`], [`Status`] | a process that is started with named descriptors, ended, and reaped |
//! | [`has_ended`], [`ended`], [`signal`], [`pid_of`], [`this_process`] | any process, held by a descriptor of it |
//! | [`UnixLink`], [`Listener`], [`connect`] | frames and descriptors between two processes |
//! | [`SharedMemory`], [`Heartbeat`] | memory that processes share and that nobody has to clean up |
//! | [`Silence`] | time since the last word of another side, as far as this side was there |
//! | [`Restarts`] | how often a lost process may be started again |
//! | [`ChildChange`], [`next_change`] | a child that is stopped, goes on or ends |
//! | [`may_lock_all`], [`limit_real_time`], [`stand_back`] | a right that a process asks the operating system for, a limit, and a right that it gives up |
//!
//! Nothing here knows a device, a kernel or a text format.
mod child;
mod clock;
mod heartbeat;
mod inherited;
mod launch;
mod link;
mod listener;
mod passing;
mod process;
mod restarts;
mod rights;
mod silence;
mod status;

pub use child::Child;
pub use clock::now_ns;
pub use heartbeat::Heartbeat;
pub use inherited::{DESCRIPTORS, NotInherited, inherited};
pub use launch::{Launch, LaunchError};
pub use link::{FRAME_LEN_MAX, Frame, UnixLink};
pub use listener::{Listener, connect, fresh_folder, is_abandoned, run_folder};
pub use passing::DESCRIPTORS_MAX;
pub use process::{ChildChange, ended, has_ended, next_change, pid_of, process_descriptor, signal, this_process};
pub use restarts::Restarts;
pub use rights::{limit_real_time, may_lock_all, stand_back};
pub use shared_memory::SealedMemory as SharedMemory;
pub use silence::Silence;
pub use status::Status;
