// SPDX-License-Identifier: Apache-2.0
//! The control interface: a real-time system as a daemon, commanded over HTTP and WebSocket. `docs/control.md` is its manual.
//!
//! [`Server::start`] serves a system. Every request passes the [`Gate`] (who calls, as what), belongs to a session where it commands,
//! is judged by what its declaration in [`api`] says, recorded by the audit, and becomes one call of that. What bodies say is decoded by
//! the pure functions of [`requests`].
mod audit;
mod caller;
pub mod calls;
mod clock;
mod code;
mod definitions;
mod failure;
mod files;
mod freshness;
mod http;
mod inside;
pub mod journal;
mod lanes;
mod leaving;
mod listen;
mod openapi;
mod paced;
mod page;
mod playing;
mod presence;
mod rates;
mod records;
pub mod requests;
mod rest;
mod schema;
mod scope;
mod secret;
mod serve;
mod service;
mod sessions;
mod shares;
mod slots;
mod socket;
mod stream;
mod tls;
pub mod tokens;
mod told;
mod version;

pub use api::Role;
pub use audit::{Act, Audit};
pub use caller::{Caller, Gate, Pass, Peer};
pub use failure::Failure;
pub use files::Files;
pub use inside::Inside;
pub use openapi::document as openapi;
pub use playing::Watcher;
pub use rates::Rates;
pub use schema::all as schemas;
pub use serve::{Options, Server};
pub use sessions::{Kept, Listed, Opened, Outcome, REPORTS_MAX, SESSIONS_EACH_MAX, SESSIONS_MAX, SETTLED_MAX, Sessions, Settled};
pub use socket::default_path;
pub use tls::{certificates, fingerprint};
