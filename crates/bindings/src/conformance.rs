// SPDX-License-Identifier: Apache-2.0
//! Conformance kit for drivers.
use crate::convert::{from_json, to_json};
use drivers::{Outcome, Settings};
use pyo3::prelude::*;
use serde_json::Value;
use std::ffi::OsString;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

/// Time limit of one check. Ensures that a hanging check is reported within a minute.
const CHECK: Duration = Duration::from_secs(50);

/// Checks a driver; returns the report as JSON. `told(check, verdict)` is called with each outcome as soon as it is available; the checks
/// end if it returns False.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they are those of Python's call")]
pub fn check_conformance(
    py: Python<'_>,
    kind: &str,
    options_json: &str,
    command: Vec<OsString>,
    exchanges: u64,
    counting: Option<PathBuf>,
    sanitizer: Option<PathBuf>,
    told: Py<PyAny>,
) -> PyResult<String> {
    let options: Value = from_json(options_json)?;
    let settings = Settings { command, exchanges, counting, sanitizer, limit: CHECK };
    let mut raised = None;
    let mut hear = |outcome: &Outcome| match Python::attach(|py| told.call1(py, (&outcome.check, outcome.verdict.text()))?.extract::<bool>(py)) {
        Ok(true) => ControlFlow::Continue(()),
        Ok(false) => ControlFlow::Break(()),
        Err(why) => {
            raised = Some(why);
            ControlFlow::Break(())
        }
    };
    let report = py.detach(|| drivers::check_conformance(kind, &options, &settings, &mut hear));
    raised.map_or_else(|| to_json(&report.json()), Err)
}

/// Returns the C source of the library that counts allocations in the process that checks a driver.
#[pyfunction]
pub fn counting_text() -> &'static str {
    Settings::COUNTING
}

/// Returns the real-time sanitizer for that process, built in a folder; `None` if no compiler on this machine provides it.
#[pyfunction]
pub fn sanitizer_in(py: Python<'_>, folder: PathBuf) -> Option<PathBuf> {
    py.detach(|| drivers::sanitizer_in(&folder))
}

/// Main function of a process in which a driver is checked.
#[pyfunction]
pub fn run_driver_check(py: Python<'_>) -> Option<String> {
    py.detach(drivers::run_check).err()
}
