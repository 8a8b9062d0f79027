// SPDX-License-Identifier: Apache-2.0
//! Processes of one host: how they are started and how they end, the link between two of them, and the guard, a small process
//! that brings the outputs of a lost one to their safe state.
//!
//! | | |
//! |---|---|
//! | [`Launch`], [`Child`], [`Status`] | a process that is started with named descriptors, ended, and reaped |
//! | [`UnixLink`], [`Listener`], [`connect`] | frames and descriptors between two processes |
//! | [`SharedMemory`], [`Heartbeat`] | memory that processes share and that nobody has to clean up |
//! | [`Guard`] | the supervisor's side of the guard: what to guard, and what to do when the guard itself is gone |
//! | [`send_handles`], [`receive_handles`] | how the supervisor of a process gets what it registers there |
//! | [`run`], [`serve`](serve::serve) | the guard process: one thread, one loop; `serve.rs` and `ward.rs` are all of it |
//! | [`Restarts`] | how often a lost process may be started again |
//!
//! The guard is no certified safety function: it shares processor, memory and operating system with what it guards.
mod child;
mod clock;
mod guard;
mod handles;
mod heartbeat;
mod inherited;
mod launch;
mod link;
mod listener;
mod memory;
mod passing;
mod registry;
mod restarts;
mod rights;
pub mod serve;
mod status;
mod ward;
mod wire;

pub use child::{Child, this_process};
pub use clock::now_ns;
pub use guard::{Found, Guard, GuardCommand, GuardError, GuardEvent};
pub use handles::{receive_handles, send_handles};
pub use heartbeat::Heartbeat;
pub use inherited::{DESCRIPTORS, NotInherited, inherited};
pub use launch::{Launch, LaunchError};
pub use link::{FRAME_LEN_MAX, Frame, UnixLink};
pub use listener::{Listener, connect, fresh_folder, is_abandoned, run_folder};
pub use memory::SharedMemory;
pub use passing::DESCRIPTORS_MAX;
pub use restarts::Restarts;
pub use serve::run;
pub use status::Status;
pub use wire::{Cause, Loss};
