// SPDX-License-Identifier: Apache-2.0
//! The control interface: a real-time system as a daemon, commanded over HTTP and WebSocket. `docs/control.md` is its manual.
//!
//! [`Server::start`] serves a system. Every request passes the [`Gate`] (who calls, as what), belongs to a session where it commands,
//! is judged by the one table of [`calls`], recorded by the audit, and becomes one call of `session`. What bodies say is decoded by
//! the pure functions of [`wire`].
mod audit;
mod caller;
pub mod calls;
mod code;
mod failure;
mod files;
mod http;
pub mod journal;
mod listen;
mod page;
mod places;
mod rates;
mod records;
mod role;
mod schema;
mod scope;
mod secret;
mod serve;
mod service;
mod sessions;
mod socket;
mod stream;
mod tls;
pub mod tokens;
pub mod wire;

pub use audit::{Act, Audit};
pub use caller::{Caller, Gate, Peer};
pub use failure::Failure;
pub use files::Files;
pub use journal::play::Watcher;
pub use rates::Rates;
pub use role::Role;
pub use schema::all as schemas;
pub use serve::{Options, Server};
pub use sessions::{Kept, Listed, Opened, REPORTS_MAX, SESSIONS_EACH_MAX, SESSIONS_MAX, Sessions};
pub use socket::default_path;
pub use tls::{certificates, fingerprint};
