// SPDX-License-Identifier: Apache-2.0
//! Drivers from files, and checks of their options before anything is opened.
use crate::convert::{from_json, to_json};
use device::Manual;
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Returns the manuals of the drivers in a file: `{"drivers": […]}`, or `{"problem": text}`.
#[pyfunction]
pub fn load_drivers(py: Python<'_>, file: PathBuf) -> PyResult<String> {
    to_json(&match py.detach(|| drivers::load(&file)) {
        Ok(found) => json!({ "drivers": found.into_iter().map(Manual::from).collect::<Vec<_>>() }),
        Err(why) => json!({ "problem": why.to_string() }),
    })
}

/// Checks the options of a driver; returns a description of the problem, or `None`.
#[pyfunction]
pub fn check_driver(py: Python<'_>, kind: &str, options_json: &str) -> PyResult<Option<String>> {
    let options: Value = from_json(options_json)?;
    Ok(py.detach(|| drivers::check(kind, &options)).err().map(|why| why.to_string()))
}

/// Main function of a process that loads one file of drivers, given by its last command-line argument, so that a faulty file crashes only
/// this process.
#[pyfunction]
pub fn run_driver_trial(py: Python<'_>) -> Option<String> {
    let file = std::env::args_os().next_back()?;
    py.detach(|| drivers::load(Path::new(&file))).err().map(|why| why.to_string())
}
