// SPDX-License-Identifier: Apache-2.0
//! A real-time system that outlives its callers: who calls, in which session, who commands, how much of everything a caller gets, and what
//! a system that is started again has to know.
//!
//! A door (the crate `control` over HTTP) decodes a request, lets its caller in at the [`Gate`], enters it into its lane ([`lanes`]) and makes one
//! call of [`Service`]. It is judged there by what its declaration in [`api`] says, recorded by the [`Audit`] and the [`journal`], and made.
mod audit;
mod caller;
pub mod calls;
pub mod clock;
pub mod code;
mod failure;
pub mod files;
mod freshness;
pub mod journal;
pub mod lanes;
mod playing;
mod rates;
mod records;
pub mod requests;
pub mod secret;
mod service;
mod sessions;
mod shares;
pub mod tokens;

pub use audit::{Act, Audit};
pub use caller::{Caller, Gate, Pass, Peer};
pub use failure::{Failure, Ground};
pub use files::Files;
pub use playing::{NoWatcher, Watcher, play};
pub use rates::Rates;
pub use service::{Presence, Service};
pub use sessions::{
    Holder, KeptReport, OpenedSession, Outcome, REPORTS_MAX, Reports, SESSIONS_EACH_MAX, SESSIONS_MAX, SETTLED_MAX, SessionAnswer, SessionInfo,
    SessionInstance, Sessions, SettledRequest,
};
pub use shares::Share;
