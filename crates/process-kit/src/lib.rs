// SPDX-License-Identifier: Apache-2.0
//! Processes of one host: their start and their end, and the link between two of them.
//!
//! | | |
//! |---|---|
//! | [`Launch`], [`Child`], [`Status`] | a process that is started with named descriptors, ended, and reaped |
//! | [`has_ended`], [`ended`], [`signal`], [`pid_of`], [`this_process`] | any process, through a descriptor of it |
//! | [`UnixLink`], [`Listener`], [`connect`] | frames and descriptors between two processes |
//! | [`SharedMemory`], [`Heartbeat`] | memory that processes share and that needs no cleaning up |
//! | [`Silence`] | time since the last message of the other side, excluding suspensions of this side |
//! | [`Restarts`] | limit on restarting a lost process |
//! | [`ChildChange`], [`next_change`] | stop, continuation or exit of a child |
//! | [`may_lock_all`], [`stand_back`] | a privilege that a process requests from the operating system, and one that it gives up |
//!
//! This crate does not depend on devices, kernels or text formats.
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
pub use listener::{Listener, connect, connect_within, fresh_folder, is_abandoned, run_folder};
pub use passing::DESCRIPTORS_MAX;
pub use process::{ChildChange, ended, has_ended, next_change, pid_of, process_descriptor, signal, this_process};
pub use restarts::Restarts;
pub use rights::{may_lock_all, stand_back};
pub use shared_memory::SealedMemory as SharedMemory;
pub use silence::Silence;
pub use status::Status;
