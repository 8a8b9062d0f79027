// SPDX-License-Identifier: Apache-2.0
//! The class `_native.System`: all calls by name, and transfers of bytes. Long calls release the interpreter lock and check for signals.
use crate::SLICE;
use crate::convert::refused;
use api::CallResult;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};
use std::sync::Arc;
use std::time::Duration;

/// Real-time system embedded in this process.
#[pyclass(frozen, subclass, module = "opengpac._native")]
pub struct System {
    inner: Arc<supervisor::System>,
}

impl System {
    /// Returns the system itself, for servers.
    pub fn shared(&self) -> Arc<supervisor::System> {
        self.inner.clone()
    }
}

#[pymethods]
impl System {
    #[new]
    fn new(name: &str, clock: &str, options_json: &str) -> PyResult<Self> {
        let inner = api::open(name, clock, options_json).map_err(refused)?;
        Ok(System { inner: Arc::new(inner) })
    }

    /// Makes a call and waits for it to end, in slices, so that Ctrl-C can interrupt it.
    #[pyo3(signature = (name, arguments_json="", /))]
    fn call(&self, py: Python<'_>, name: &str, arguments_json: &str) -> PyResult<String> {
        let call = api::known(name).map_err(refused)?;
        let mut answered = py.detach(|| call.begin_as_program(&self.inner, arguments_json, SLICE)).map_err(refused)?;
        loop {
            match answered {
                CallResult::Done(text) => return Ok(text),
                CallResult::Waiting { call, arguments } => {
                    py.check_signals()?;
                    let call = api::known(call).map_err(refused)?;
                    answered = py.detach(|| call.go_on(&self.inner, &arguments.to_string(), SLICE)).map_err(refused)?;
                }
            }
        }
    }

    /// Makes a call for at most `slice_ns` of real time; returns `None` if it has not ended by then.
    #[pyo3(signature = (name, arguments_json, slice_ns, /))]
    fn begin(&self, py: Python<'_>, name: &str, arguments_json: &str, slice_ns: u64) -> PyResult<Option<String>> {
        let call = api::known(name).map_err(refused)?;
        let answered = py.detach(|| call.begin_as_program(&self.inner, arguments_json, Duration::from_nanos(slice_ns))).map_err(refused)?;
        py.check_signals()?;
        Ok(if let CallResult::Done(text) = answered { Some(text) } else { None })
    }

    /// Calls a verb for at most `slice_ns` of real time; returns `None` if it has not ended by then. If the call continues, its instance
    /// number is stored in `made` before an interrupt is possible, so that the instance can be ended.
    #[pyo3(signature = (arguments_json, made, slice_ns, /))]
    fn performing(&self, py: Python<'_>, arguments_json: &str, made: &Bound<'_, PyList>, slice_ns: u64) -> PyResult<Option<String>> {
        let call = api::with_effect(api::Effect::PerformsVerb);
        match py.detach(|| call.begin_as_program(&self.inner, arguments_json, Duration::from_nanos(slice_ns))).map_err(refused)? {
            CallResult::Done(text) => Ok(Some(text)),
            CallResult::Waiting { arguments, .. } => {
                made.append(arguments["instance"].as_u64())?;
                Ok(None)
            }
        }
    }

    fn ended_fd(&self) -> i32 {
        self.inner.ended_fd()
    }

    #[allow(clippy::type_complexity, reason = "the tuple is the Python face")]
    #[pyo3(signature = (names, /))]
    fn read<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<(i64, Vec<(Bound<'py, PyBytes>, u64, i64)>)> {
        let (time_ns, readings) = py.detach(|| self.inner.read(&names)).map_err(refused)?;
        let readings = readings.into_iter().map(|(bytes, number, at)| (PyBytes::new(py, &bytes), number, at)).collect();
        Ok((time_ns, readings))
    }

    /// Stores numbers, advances the virtual clock, and reads values; returns the concatenated bytes of all readings.
    #[pyo3(signature = (stores, duration_ns, names, /))]
    fn turn<'py>(&self, py: Python<'py>, stores: Vec<(String, Vec<f64>)>, duration_ns: i64, names: Vec<String>) -> PyResult<Bound<'py, PyBytes>> {
        let readings = py.detach(|| self.inner.turn(&stores, duration_ns, &names)).map_err(refused)?;
        py.check_signals()?;
        let bytes: Vec<u8> = readings.into_iter().flat_map(|(bytes, _, _)| bytes).collect();
        Ok(PyBytes::new(py, &bytes))
    }

    #[pyo3(signature = (name, count, /))]
    fn history<'py>(&self, py: Python<'py>, name: &str, count: usize) -> PyResult<Vec<(u64, i64, Bound<'py, PyBytes>)>> {
        let values = py.detach(|| self.inner.history(name, count)).map_err(refused)?;
        Ok(values.into_iter().map(|(number, at, bytes)| (number, at, PyBytes::new(py, &bytes))).collect())
    }

    fn close(&self, py: Python<'_>) {
        py.detach(|| self.inner.close());
    }
}
