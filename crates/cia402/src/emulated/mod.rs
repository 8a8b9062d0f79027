// SPDX-License-Identifier: Apache-2.0
//! An emulated drive, for use on an emulated bus, and the server of such a bus.
mod brake;
mod drive;
mod homing;
mod objects;
mod serving;

pub use drive::{Drive, PRODUCT, VENDOR};
pub use homing::Limits;
pub use objects::{Access, Handle, MappedObject, Objects};
pub use serving::{Server, serve_orders};
