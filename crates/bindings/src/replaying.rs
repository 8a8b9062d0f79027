// SPDX-License-Identifier: Apache-2.0
//! Replays records: `_native.replay`.
use crate::SLICE;
use crate::convert::{from_json, interpreter, to_json};
use ::replay::{ReplayOptions, Run};
use model::refusal::{Class, Refusal};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Replays a record. The request and the findings are JSON (`replay::ReplayOptions`, `replay::ReplayResult`).
#[pyfunction]
pub fn replay(py: Python<'_>, path: PathBuf, asked_json: &str) -> PyResult<String> {
    let asked = ReplayOptions { python: interpreter(py)?, ..from_json(asked_json)? };
    let refused = |why: String| crate::convert::refused(vec![Refusal::new(Class::CallError, why)]);
    let mut run = Run::open(&path, asked).map_err(refused)?;
    loop {
        if let Some(found) = run.some(SLICE).map_err(refused)? {
            return to_json(&found);
        }
        py.check_signals()?;
    }
}

/// Returns the code modules in a record as JSON (`replay::CodeFile`), without running them.
#[pyfunction]
pub fn replay_modules(path: PathBuf) -> PyResult<String> {
    let refused = |why: String| crate::convert::refused(vec![Refusal::new(Class::CallError, why)]);
    to_json(&::replay::modules_in(&path).map_err(refused)?)
}
