// SPDX-License-Identifier: Apache-2.0
//! A real-time processor in a process of its own, on this host or on another one.
//!
//! The side that commands has a [`Processor`]: to its host a [`runtime::Remote`], which runs sources like any other. The side that runs
//! is [`serve`]: a host of its own, with its kernels, devices and code, that does what comes over the [`interconnect::Link`]. What
//! travels is in [`protocol`]; scripts and tables in [`runtime::encoding`].
//!
//! | thread of the processor | does |
//! |---|---|
//! | the one that calls `serve` | takes what comes: scripts, questions, modules, devices |
//! | `tells` | sends events as they are made, and every 20 ms how sources, connections and devices stand |
//! | `heart` | beats for the guard while the sources serve; it never waits |
//! | one a source | its kernel |
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
