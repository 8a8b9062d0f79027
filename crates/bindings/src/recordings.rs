// SPDX-License-Identifier: Apache-2.0
//! Reads recordings: `_native.Recording`. This module only converts.
use crate::convert::{refused, to_json};
use indexmap::IndexMap;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::json;
use std::path::PathBuf;

/// Numbers (u64), times in ns (i64) and values of a series, each column as bytes.
type Columns<'py> = (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

/// A recording in memory.
#[pyclass(frozen, module = "opengpac._native")]
pub struct Recording {
    inner: recorder::Recording,
}

#[pymethods]
impl Recording {
    /// Returns `{name: {kind, type, type_text, unit, count}}` for the recorded series.
    fn series_json(&self) -> PyResult<String> {
        let about = self.inner.series.iter().map(|(name, series)| {
            let of = &series.value_type;
            let described = json!({"kind": series.kind, "type": of.tree(), "type_text": of.normalised(), "unit": series.unit, "count": series.numbers.len()});
            (name.as_str(), described)
        });
        to_json(&about.collect::<IndexMap<_, _>>())
    }

    fn series<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Columns<'py>> {
        let series = self.inner.series.get(name).ok_or_else(|| PyKeyError::new_err(name.to_owned()))?;
        let numbers: Vec<u8> = series.numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let times: Vec<u8> = series.times_ns.iter().flat_map(|time_ns| time_ns.to_le_bytes()).collect();
        Ok((PyBytes::new(py, &numbers), PyBytes::new(py, &times), PyBytes::new(py, &series.bytes)))
    }

    /// Returns the messages of another channel as a list of [time in ns, message] pairs.
    fn records_json(&self, topic: &str) -> PyResult<String> {
        to_json(&self.inner.records.get(topic).map_or(&[][..], Vec::as_slice))
    }

    /// Returns the names of the other channels.
    fn topics(&self) -> Vec<String> {
        self.inner.records.keys().cloned().collect()
    }

    /// Returns `{complete, metadata, lost, damage}`.
    fn about_json(&self) -> PyResult<String> {
        to_json(&json!({"complete": self.inner.complete, "metadata": self.inner.metadata, "lost": self.inner.lost(), "damage": self.inner.damage}))
    }
}

/// Reads a recording.
#[pyfunction]
pub fn open_recording(py: Python<'_>, path: PathBuf) -> PyResult<Recording> {
    Ok(Recording { inner: py.detach(|| recorder::Recording::open(&path)).map_err(refused)? })
}
