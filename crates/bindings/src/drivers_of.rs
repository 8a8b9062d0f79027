// SPDX-License-Identifier: Apache-2.0
//! Drivers that are registered in this process: their declarations, and the devices that they find.
use crate::convert::{from_json, to_json};
use model::refusal::{Class, Refusal};
use pyo3::prelude::*;

/// Returns the declarations of the drivers as a JSON list, sorted by name.
#[pyfunction]
pub fn drivers_json() -> PyResult<String> {
    to_json(&drivers::manuals())
}

/// Returns the devices that a driver finds as a JSON list.
#[pyfunction]
pub fn scan(py: Python<'_>, kind: &str, options_json: &str) -> PyResult<String> {
    let options: serde_json::Value = from_json(options_json)?;
    let found = py.detach(|| drivers::scan(kind, &options));
    match found {
        Ok(found) => to_json(&found),
        Err(why) => Err(crate::convert::refused(vec![Refusal::new(class(&why), why.to_string())])),
    }
}

fn class(why: &device::DriverError) -> Class {
    match why {
        device::DriverError::UnknownKind { .. } => Class::UnknownName,
        device::DriverError::Option { .. } | device::DriverError::NoScan { .. } => Class::CallError,
        _ => Class::DeviceFailed,
    }
}
