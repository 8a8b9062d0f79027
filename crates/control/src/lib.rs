// SPDX-License-Identifier: Apache-2.0
//! The control interface: serves a [`daemon`] over HTTP and WebSocket. `docs/control.md` is its manual.
//!
//! [`Server::start`] serves a system. Every request passes the [`Site`] (origin) and the daemon's gate (caller and role); its body is
//! decoded and becomes one action of the daemon's [`daemon::Service`]. This crate makes no decisions of its own.
mod definitions;
mod door;
mod frames;
mod heard;
mod http;
mod inside;
mod leaving;
mod listen;
mod openapi;
mod paced;
mod page;
mod presence;
mod refused;
mod rest;
mod schema;
mod scope;
mod serve;
mod site;
mod slots;
mod socket;
mod strangers;
mod stream;
mod tls;
mod told;
mod version;

pub use frames::{StreamRequest, Topic, frame};
pub use inside::Inside;
pub use openapi::document as openapi;
pub use schema::all as schemas;
pub use serve::{Options, Server};
pub use site::Site;
pub use socket::default_path;
pub use tls::{certificates, fingerprint};
