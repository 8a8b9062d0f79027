// SPDX-License-Identifier: Apache-2.0
//! The guard: two small processes that bring the outputs of a lost process to their safe state. Both receive the same requests and act
//! alike, so that one guards while the other is being replaced.
//!
//! | | |
//! |---|---|
//! | [`Guard`] | the supervisor's side of both: registrations and events; `member.rs`: one of them, replaced when it exits; `standing_in.rs`: the one that guards in the meantime |
//! | [`send_handles`], [`receive_handles`] | transfer of handles to the supervisor of a process, which registers them with the guard |
//! | [`watch`] | the rules by which a process counts as lost, and the consequences: values without a clock, a thread or a descriptor |
//! | [`make_safe`] | the writes of the guard, for the supervisor of a lost thread |
//! | [`run`], [`serve`](serve::serve) | the guard process: one thread, one loop; `serve.rs`, `wards.rs`, `ward.rs` and `watch.rs` are all of it |
//!
//! The guard is not a certified safety function: it shares processor, memory and operating system with the guarded processes. It depends
//! on the safe handles of crate `device` and the processes of crate `process_kit`, but not on kernels, verbs or drivers.
pub mod canary;
mod guard;
mod guard_event;
mod handles;
mod member;
mod messages;
mod registry;
mod reports;
mod rights;
mod safe;
pub mod serve;
mod standing_in;
mod starting;
mod stopped;
mod ward;
mod wards;
pub mod watch;
mod watcher;

pub use guard::Guard;
pub use guard_event::{FoundWard, GuardCommand, GuardError, GuardEvent};
pub use handles::{receive_handles, send_handles};
pub use messages::Loss;
pub use safe::make_safe;
pub use serve::{Hearts, run};
pub use watch::{Bounds, Cause};
