// SPDX-License-Identifier: Apache-2.0
//! The conformance kit of drivers.
use crate::convert::{from_json, to_json};
use drivers::{Outcome, Settings};
use pyo3::prelude::*;
use serde_json::Value;
use std::ffi::OsString;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

/// Time limit of one check: what hangs is told within a minute.
const CHECK: Duration = Duration::from_secs(50);

/// Checks a driver: its report as JSON. `told(check, verdict)` is called with each outcome as it comes, and ends the checks by returning False.
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
