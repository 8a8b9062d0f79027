// SPDX-License-Identifier: Apache-2.0
//! Processes that are started for one purpose: the guard, a plant. `python/opengpac/system/processes.py` has their command lines.
use pyo3::prelude::*;

#[pyfunction]
pub fn run_guard(py: Python<'_>) -> Option<String> {
    py.detach(|| {
        let guarded = places::guard_processes();
        drivers::clean_processes();
        guarded.err()
    })
}

/// Runs a recording again, beside the system that asks for it.
#[pyfunction]
pub fn run_replay(py: Python<'_>) -> Option<String> {
    py.detach(::replay::serve).err()
}

#[pyfunction]
pub fn run_plant(py: Python<'_>) -> Option<String> {
    py.detach(drivers::run_process).err()
}

/// An emulated segment of EtherCAT: answers until its input ends.
#[pyfunction]
pub fn run_ethercat_segment(py: Python<'_>) -> Option<String> {
    py.detach(ethercat::emulator::run).err()
}

/// An emulated bus of CANopen: answers until its input ends.
#[pyfunction]
pub fn run_canopen_bus(py: Python<'_>) -> Option<String> {
    py.detach(canopen::emulator::run).err()
}

#[pyfunction]
pub fn plant_state(py: Python<'_>, name: &str) -> PyResult<Option<String>> {
    match py.detach(|| drivers::process_state(name)) {
        Ok(state) => Ok(Some(crate::convert::to_json(&state)?)),
        Err(_nobody) => Ok(None),
    }
}

/// Tries the files that the options of a driver name, in a process of its own; the text says what is wrong with them.
#[pyfunction]
pub fn try_driver(py: Python<'_>, kind: &str, options_json: &str) -> PyResult<Option<String>> {
    let options: serde_json::Value = crate::convert::from_json(options_json)?;
    Ok(py.detach(|| drivers::try_options(kind, &options)).err().map(|why| why.to_string()))
}

/// Lends this host to a system until that is gone or a signal comes; the text says why it could not.
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
