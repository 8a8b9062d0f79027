// SPDX-License-Identifier: Apache-2.0
//! What a process runs that is started for one purpose: the guard, a plant. `python/opengpac/processes.py` has their command lines.
use pyo3::prelude::*;
use std::path::PathBuf;

#[pyfunction]
pub fn run_guard(py: Python<'_>) -> Option<String> {
    py.detach(places::guard_processes).err()
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

/// Tries a MuJoCo model in a process of its own; the text says what is wrong with it.
#[pyfunction]
pub fn try_model(py: Python<'_>, path: PathBuf, library: Option<PathBuf>) -> Option<String> {
    py.detach(|| drivers::mujoco::try_model(&path, library.as_deref())).err().map(|why| why.to_string())
}

/// Lends this host to a system until that is gone or a signal comes; the text says why it could not.
#[cfg(feature = "hosts")]
#[pyfunction]
pub fn join_system(py: Python<'_>, system: &str, options_json: &str) -> PyResult<Option<String>> {
    let options: places::JoinOptions = crate::convert::from_json(options_json)?;
    let python = crate::convert::interpreter(py)?;
    let signalled = std::sync::Mutex::new(None);
    let stop = || {
        let checked = Python::attach(|py| py.check_signals());
        match checked {
            Ok(()) => false,
            Err(signal) => {
                *signalled.lock().expect("nobody panics with the lock held") = Some(signal);
                true
            }
        }
    };
    let joined = py.detach(|| places::join(system, options, python.into(), &stop));
    match signalled.into_inner().expect("nobody panics with the lock held") {
        Some(signal) => Err(signal),
        None => Ok(joined.err()),
    }
}

/// This build is without processors on other hosts.
#[cfg(not(feature = "hosts"))]
#[pyfunction]
pub fn join_system(_system: &str, _options_json: &str) -> Option<String> {
    Some("this build is without processors on other hosts; build it with the feature 'hosts'".to_owned())
}
