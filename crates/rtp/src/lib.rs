// SPDX-License-Identifier: Apache-2.0
//! A real-time processor in a process of its own, on this host or another one.
//!
//! The commanding side has a [`Processor`]: a [`runtime::Remote`] to its host, which runs sources like any other. The running side is
//! [`serve`]: a separate host, with its own kernels, devices and code, that carries out orders received over the [`interconnect::Link`].
//! The messages are defined in [`protocol`]; scripts and tables are encoded by [`runtime::encoding`].
//!
//! | thread of the processor | does |
//! |---|---|
//! | caller of `serve` | processes orders: scripts, questions, modules, devices |
//! | `tells` | sends events as they occur, and every 20 ms the state of sources, connections and devices |
//! | `heart` | beats for the guard while the sources serve; never waits |
//! | one per source | its kernel |
//!
//! It knows no verb, no supervisor and no Python.
mod agent;
mod code;
mod heart;
mod module;
mod places;
mod processor;
pub mod protocol;
mod reopening;
mod script_context;
mod serve;
mod service;
mod shared;
mod take_over;
mod tells;

pub use code::Code;
pub use heart::{BEAT, Firings};
pub use module::{Module, name_of, sha256};
pub use places::{Bounds, Holder, NO_HOSTS, Near, Places, ProcessorHold, ProcessorProcess, StartedProcessor, Tell};
pub use processor::{OpenedDevice, Processor};
pub use serve::serve;
pub use service::{AdmittedSupervisor, BlackBox, Caller, Door, OnDevice, Reaches, Rests, Service, Terms, UnwatchedCheck};
