// SPDX-License-Identifier: Apache-2.0
//! Conversions between Python and the model: values as JSON in both directions, refusals as exceptions.
use model::refusal::Refusals;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

create_exception!(opengpac._native, Refused, PyException, "One or more refusals; nothing has changed. `args[0]` is their JSON.");

/// Converts refusals to an exception.
pub fn refused(refusals: Refusals) -> PyErr {
    match serde_json::to_string(&refusals) {
        Ok(json) => Refused::new_err(json),
        Err(why) => PyValueError::new_err(why.to_string()),
    }
}

/// Parses a value of the model from JSON; refuses malformed values with a definition error.
pub fn from_json<T: DeserializeOwned>(json: &str) -> PyResult<T> {
    api::from_json(json).map_err(refused)
}

/// Serialises a value to JSON.
pub fn to_json(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|why| PyValueError::new_err(why.to_string()))
}

/// Returns the interpreter that runs this code; code modules are tested with it in a child process.
pub fn interpreter(py: Python<'_>) -> PyResult<String> {
    let executable: Option<String> = py.import("sys")?.getattr("executable")?.extract()?;
    Ok(executable.filter(|e| !e.is_empty()).unwrap_or_else(|| "python3".to_owned()))
}
