// SPDX-License-Identifier: Apache-2.0
//! The model: types, interfaces, graphs, verbs, devices, and all checks on them. It converts a verb and its arguments to a flat, resolved
//! and checked [`plan::Plan`]. It uses no clock, thread, file, network or `unsafe`.
#![forbid(unsafe_code)]

mod apply;
mod checked;
pub mod compose;
mod conditions;
pub mod configuration;
pub mod conformity;
mod constants;
mod cover;
mod cycles;
pub mod definition;
mod elements;
mod ending;
pub mod file;
mod flatten;
mod form;
pub mod idle;
pub mod interface;
mod kind;
mod lists;
pub mod members;
pub mod order;
mod parameters;
pub mod plan;
pub mod quantity;
pub mod range;
mod reach;
pub mod refusal;
pub mod types;
mod undriven;
pub mod value;
mod wires;
pub mod wording;
pub mod workspace;
mod writers;

pub use ::hints;
pub use apply::apply;
pub use checked::{CheckedVerb, check_graph, check_verb};
pub use compose::{Composition, compose};
pub use conditions::{ENDS, LIMITS, ORDERLY, SYSTEM, SystemCondition};
pub use form::{ArgumentKind, FormArgument, FormInput};
pub use wires::{Drawing, PortName, Verdict, check_definition, check_drawing, compatible, compatible_with};
