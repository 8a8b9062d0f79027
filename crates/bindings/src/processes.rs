// SPDX-License-Identifier: Apache-2.0
//! What a process runs that is started for one purpose: the guard, a plant. `python/opengpac/processes.py` has their command lines.
use pyo3::prelude::*;

#[pyfunction]
pub fn run_guard(py: Python<'_>) -> Option<String> {
    py.detach(guard::run).err()
}

#[pyfunction]
pub fn run_plant(py: Python<'_>) -> Option<String> {
    py.detach(drivers::plant_process::run).err()
}

#[pyfunction]
pub fn plant_state(py: Python<'_>, name: &str) -> PyResult<Option<String>> {
    match py.detach(|| drivers::plant_process::state(name)) {
        Ok(state) => Ok(Some(crate::convert::to_json(&state)?)),
        Err(_nobody) => Ok(None),
    }
}
