// SPDX-License-Identifier: Apache-2.0
//! Conversions between Python and the model: JSON one way and the other, refusals as an exception.
use model::refusal::Refusals;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

create_exception!(opengpac._native, Refused, PyException, "One or more refusals; nothing has changed. `args[0]` is their JSON.");

/// Refusals as an exception.
pub fn refused(refusals: Refusals) -> PyErr {
    match serde_json::to_string(&refusals) {
        Ok(json) => Refused::new_err(json),
        Err(why) => PyValueError::new_err(why.to_string()),
    }
}

/// A value of the model from JSON; what is not of its form is refused as a definition error.
pub fn from_json<T: DeserializeOwned>(json: &str) -> PyResult<T> {
    api::from_json(json).map_err(refused)
}

/// JSON of a value.
pub fn to_json(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|why| PyValueError::new_err(why.to_string()))
}

/// The interpreter that runs this: it tries code modules in a child of its own.
pub fn interpreter(py: Python<'_>) -> PyResult<String> {
    let executable: Option<String> = py.import("sys")?.getattr("executable")?.extract()?;
    Ok(executable.filter(|e| !e.is_empty()).unwrap_or_else(|| "python3".to_owned()))
}
