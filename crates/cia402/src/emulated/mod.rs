// SPDX-License-Identifier: Apache-2.0
//! An emulated drive, which an emulated bus puts on its line, and what serves such a bus.
mod brake;
mod drive;
mod homing;
mod objects;
mod serving;

pub use drive::{Drive, PRODUCT, VENDOR};
pub use homing::Limits;
pub use objects::{Access, Handle, MappedObject, Objects};
pub use serving::{Server, serve_orders};
