// SPDX-License-Identifier: Apache-2.0
//! Processes with a single purpose, such as the guard or a plant. `python/opengpac/system/processes.py` contains their command lines.
use pyo3::prelude::*;

#[pyfunction]
pub fn run_guard(py: Python<'_>) -> Option<String> {
    py.detach(|| {
        let guarded = places::guard_processes();
        drivers::clean_processes();
        guarded.err()
    })
}

/// Main function of a process that replays a recording while a system runs.
#[pyfunction]
pub fn run_replay(py: Python<'_>) -> Option<String> {
    py.detach(::replay::serve).err()
}

#[pyfunction]
pub fn run_plant(py: Python<'_>) -> Option<String> {
    py.detach(drivers::run_process).err()
}

/// Runs an emulated EtherCAT segment until its input ends.
#[pyfunction]
pub fn run_ethercat_segment(py: Python<'_>) -> Option<String> {
    py.detach(ethercat::emulator::run).err()
}

/// Runs an emulated CANopen bus until its input ends.
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

/// Tests the files listed in a driver's options in a separate process; returns a description of the problem, if any.
#[pyfunction]
pub fn try_driver(py: Python<'_>, kind: &str, options_json: &str) -> PyResult<Option<String>> {
    let options: serde_json::Value = crate::convert::from_json(options_json)?;
    Ok(py.detach(|| drivers::try_options(kind, &options)).err().map(|why| why.to_string()))
}

/// Lends this host to a system until the system ends or a signal arrives; returns the reason if this fails.
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
