// SPDX-License-Identifier: Apache-2.0
//! The model: its refusals, its plans, its forms.
#[path = "../common/mod.rs"]
mod common;

mod absence;
mod compose;
mod compose_refusals;
mod conformity;
mod graphs;
mod order;
mod plans;
mod refusals;
mod schema;
mod types;
mod wires;
mod workspaces;
mod written;
