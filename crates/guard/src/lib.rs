// SPDX-License-Identifier: Apache-2.0
//! The guard: two small processes that bring the outputs of a lost one to their safe state. Both are told the same and act alike, so
//! that one
//! guards while the other is being replaced.
//!
//! | | |
//! |---|---|
//! | [`Guard`] | the supervisor's side of both: what to guard, and what is said of it; `member.rs`: one of them, replaced when it is gone; `standing_in.rs`: the one that guards meanwhile |
//! | [`send_handles`], [`receive_handles`] | how the supervisor of a process gets what it registers there |
//! | [`watch`] | the rules by which a process counts as lost, and what follows: values without a clock, a thread or a descriptor |
//! | [`make_safe`] | what it writes, for the supervisor of a thread that is lost |
//! | [`run`], [`serve`](serve::serve) | the guard process: one thread, one loop; `serve.rs`, `wards.rs`, `ward.rs` and `watch.rs` are all of it |
//!
//! The guard is no certified safety function: it shares processor, memory and operating system with what it guards. It knows the safe
//! handles of crate `device` and the processes of crate `process_kit`; no kernel, verb or driver.
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
