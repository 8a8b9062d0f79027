// SPDX-License-Identifier: Apache-2.0
//! The model: what is refused, what is planned, what the forms are.
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
