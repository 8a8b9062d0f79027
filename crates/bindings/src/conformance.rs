// SPDX-License-Identifier: Apache-2.0
//! The conformance kit of drivers.
use crate::convert::{from_json, to_json};
use drivers::Settings;
use pyo3::prelude::*;
use serde_json::Value;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

/// How long one check may take.
const CHECK: Duration = Duration::from_secs(120);

/// Checks a driver: its report as JSON.
#[pyfunction]
#[pyo3(signature = (kind, options_json, command, exchanges, counting=None, sanitizer=None))]
pub fn check_conformance(
    py: Python<'_>,
    kind: &str,
    options_json: &str,
    command: Vec<OsString>,
    exchanges: u64,
    counting: Option<PathBuf>,
    sanitizer: Option<PathBuf>,
) -> PyResult<String> {
    let options: Value = from_json(options_json)?;
    let settings = Settings { command, exchanges, counting, sanitizer, limit: CHECK };
    to_json(&py.detach(|| drivers::check_conformance(kind, &options, &settings)).json())
}

/// The source in C of what counts allocations in the process that a driver is checked in.
#[pyfunction]
pub fn counting_text() -> &'static str {
    Settings::COUNTING
}

/// The real-time sanitizer for that process, made in a folder; None: no compiler here has it.
#[pyfunction]
pub fn sanitizer_in(py: Python<'_>, folder: PathBuf) -> Option<PathBuf> {
    py.detach(|| drivers::sanitizer_in(&folder))
}

/// The life of a process that a driver is checked in.
#[pyfunction]
pub fn run_driver_check(py: Python<'_>) -> Option<String> {
    py.detach(drivers::run_check).err()
}
