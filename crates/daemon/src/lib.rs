// SPDX-License-Identifier: Apache-2.0
//! A real-time system that outlives its callers: authenticates callers, manages their sessions and command, limits their use of
//! resources, and restores the system after a restart.
//!
//! A front end (the crate `control` over HTTP) decodes a request, authenticates its caller at the [`Gate`], admits it to its lane
//! ([`lanes`]) and makes one call of [`Service`]. There the request is checked against its declaration in [`api`], recorded by the
//! [`Audit`] and the [`journal`], and executed.
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
