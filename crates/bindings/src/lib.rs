// SPDX-License-Identifier: Apache-2.0
//! Python bindings of the supervisor's `System`. They only convert; `python/opengpac/_native.pyi` documents each call.
mod conformance;
mod convert;
mod drivers_in_files;
mod drivers_of;
mod poses;
mod processes;
mod python_driver;
mod recordings;
mod replaying;
mod serve;
mod system;

use crate::convert::{Refused, from_json, refused, to_json};
use indexmap::IndexMap;
use model::definition::{DeviceType, Graph, Verb};
use model::refusal::{Class, Refusal};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::time::Duration;
use supervisor::TrialRequest;

/// Maximum time for which a call runs without checking for signals.
const SLICE: Duration = Duration::from_millis(50);

#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

#[pyfunction]
fn library_json() -> String {
    serde_json::to_string(&supervisor::library()).expect("these have no map with keys that are no texts")
}

#[pyfunction]
fn header_text() -> &'static str {
    opengpac::HEADER
}

#[pyfunction]
fn driver_header_text() -> &'static str {
    opengpac::DRIVER_HEADER
}

#[pyfunction]
#[pyo3(signature = (sources, output=None))]
fn build(py: Python<'_>, sources: Vec<PathBuf>, output: Option<PathBuf>) -> PyResult<String> {
    let python = convert::interpreter(py)?;
    let path = py.detach(|| supervisor::build(&sources, output, &python)).map_err(refused)?;
    Ok(path.display().to_string())
}

#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they are those of Python's call")]
fn trial(
    py: Python<'_>,
    module: &str,
    block: &str,
    values_json: &str,
    inputs_json: &str,
    times: usize,
    period_ns: i64,
    is_interpreted: bool,
) -> PyResult<String> {
    let python = convert::interpreter(py)?;
    let given = TrialRequest { values: from_json(values_json)?, inputs: from_json(inputs_json)?, times, period_ns, is_interpreted };
    let mut trial = py.detach(|| supervisor::trial(module, block, given, &python)).map_err(refused)?;
    while py.detach(|| trial.go_on(SLICE)).map_err(refused)? {
        py.check_signals()?;
    }
    py.check_signals()?;
    Ok(trial.json().to_string())
}

#[pyfunction]
fn type_json(type_text: &str, types_json: &str) -> PyResult<String> {
    let types: IndexMap<String, String> = from_json(types_json)?;
    let of = model::types::Type::parse(type_text, &types).map_err(|refusal| refused(vec![refusal]))?;
    to_json(&of.tree())
}

#[pyfunction]
fn number_in(text: &str, unit: &str) -> PyResult<f64> {
    model::quantity::number_in(text, unit).map_err(|refusal| refused(vec![refusal]))
}

#[pyfunction]
fn check_range(what: &str, declared: &str, number: f64) -> PyResult<()> {
    let (unit, range) = model::range::Range::split(declared);
    let range = range.unwrap_or_else(|| model::range::plausible(unit));
    range.check(what, unit, &model::value::Value::Number(number)).map_err(|refusal| refused(vec![refusal]))
}

#[pyfunction]
fn check_angle(what: &str, angle: f64) -> PyResult<()> {
    model::range::check_angle(what, angle).map_err(|refusal| refused(vec![refusal]))
}

#[pyfunction]
fn duration_ns(text: &str, what: &str) -> PyResult<i64> {
    model::quantity::duration_ns(text, what).map_err(|refusal| refused(vec![refusal]))
}

#[pyfunction]
fn check_name(what: &str, name: &str) -> PyResult<()> {
    supervisor::check_name(what, name).map_err(refused)
}

#[pyfunction]
fn did_you_mean(word: &str, candidates: Vec<String>) -> String {
    model::hints::did_you_mean(word, candidates.iter().map(String::as_str))
}

#[pyfunction]
fn nearest(word: &str, candidates: Vec<String>) -> Option<String> {
    model::hints::nearest(word, candidates.iter().map(String::as_str)).map(str::to_owned)
}

/// Returns the extensions, without the dot, of source files that are built when they are loaded.
#[pyfunction]
fn source_endings() -> Vec<&'static str> {
    modules::source_endings()
}

/// Returns true if a name in a definition has another meaning in C code.
#[pyfunction]
fn is_word_of_c(name: &str) -> bool {
    modules::is_word_of_c(name)
}

/// Returns the file of a network with the weights from neighbouring files embedded; `None` if it already contains them.
#[pyfunction]
fn whole_network<'py>(py: Python<'py>, content: Vec<u8>, path: PathBuf) -> PyResult<Option<Bound<'py, PyBytes>>> {
    let whole = py.detach(|| modules::whole_network(&content, &path));
    let whole = whole.map_err(|what| refused(vec![Refusal::new(Class::ModuleError, format!("policy '{}' is refused: {what}", path.display()))]))?;
    Ok(whole.map(|bytes| PyBytes::new(py, &bytes)))
}

/// Converts a definition to its long form.
#[pyfunction]
fn long_form(kind: &str, definition_json: &str) -> PyResult<String> {
    match kind {
        "graph" => to_json(&from_json::<Graph>(definition_json)?),
        "verb" => to_json(&from_json::<Verb>(definition_json)?),
        _ => to_json(&from_json::<DeviceType>(definition_json)?),
    }
}

/// Main function of a process that was started for a processor; returns the reason if it could not serve.
#[pyfunction]
fn run_processor(py: Python<'_>) -> Option<String> {
    py.detach(places::processor).err()
}

#[pymodule]
fn _native(m: &Bound<'_, PyModule>) -> PyResult<()> {
    device::lend_interpreter(convert::interpreter(m.py())?);
    device::register(&python_driver::DRIVER).expect("nobody else has its name");
    m.add("Refused", m.py().get_type::<Refused>())?;
    m.add_class::<system::System>()?;
    m.add_class::<recordings::Recording>()?;
    m.add_function(wrap_pyfunction!(recordings::open_recording, m)?)?;
    m.add_class::<serve::SystemServer>()?;
    m.add_function(wrap_pyfunction!(version, m)?)?;
    m.add_function(wrap_pyfunction!(library_json, m)?)?;
    m.add_function(wrap_pyfunction!(header_text, m)?)?;
    m.add_function(wrap_pyfunction!(build, m)?)?;
    m.add_function(wrap_pyfunction!(trial, m)?)?;
    m.add_function(wrap_pyfunction!(type_json, m)?)?;
    m.add_function(wrap_pyfunction!(is_word_of_c, m)?)?;
    m.add_function(wrap_pyfunction!(whole_network, m)?)?;
    m.add_function(wrap_pyfunction!(number_in, m)?)?;
    m.add_function(wrap_pyfunction!(check_range, m)?)?;
    m.add_function(wrap_pyfunction!(check_angle, m)?)?;
    m.add_function(wrap_pyfunction!(duration_ns, m)?)?;
    m.add_function(wrap_pyfunction!(long_form, m)?)?;
    m.add_function(wrap_pyfunction!(check_name, m)?)?;
    m.add_function(wrap_pyfunction!(did_you_mean, m)?)?;
    m.add_function(wrap_pyfunction!(nearest, m)?)?;
    m.add_function(wrap_pyfunction!(source_endings, m)?)?;
    m.add_function(wrap_pyfunction!(poses::pose_of, m)?)?;
    m.add_function(wrap_pyfunction!(poses::pose_of_rpy, m)?)?;
    m.add_function(wrap_pyfunction!(poses::pose_rpy, m)?)?;
    m.add_function(wrap_pyfunction!(poses::pose_then, m)?)?;
    m.add_function(wrap_pyfunction!(poses::pose_point, m)?)?;
    m.add_function(wrap_pyfunction!(poses::pose_inverse, m)?)?;
    m.add_function(wrap_pyfunction!(poses::pose_between, m)?)?;
    m.add_function(wrap_pyfunction!(run_processor, m)?)?;
    m.add_function(wrap_pyfunction!(processes::run_guard, m)?)?;
    m.add_function(wrap_pyfunction!(processes::join_system, m)?)?;
    m.add_function(wrap_pyfunction!(processes::run_plant, m)?)?;
    m.add_function(wrap_pyfunction!(processes::run_replay, m)?)?;
    m.add_function(wrap_pyfunction!(processes::run_ethercat_segment, m)?)?;
    m.add_function(wrap_pyfunction!(processes::run_canopen_bus, m)?)?;
    m.add_function(wrap_pyfunction!(processes::plant_state, m)?)?;
    m.add_function(wrap_pyfunction!(processes::try_driver, m)?)?;
    m.add_function(wrap_pyfunction!(drivers_of::drivers_json, m)?)?;
    m.add_function(wrap_pyfunction!(drivers_of::scan, m)?)?;
    m.add_function(wrap_pyfunction!(driver_header_text, m)?)?;
    m.add_function(wrap_pyfunction!(conformance::check_conformance, m)?)?;
    m.add_function(wrap_pyfunction!(conformance::counting_text, m)?)?;
    m.add_function(wrap_pyfunction!(conformance::run_driver_check, m)?)?;
    m.add_function(wrap_pyfunction!(conformance::sanitizer_in, m)?)?;
    m.add_function(wrap_pyfunction!(drivers_in_files::load_drivers, m)?)?;
    m.add_function(wrap_pyfunction!(drivers_in_files::check_driver, m)?)?;
    m.add_function(wrap_pyfunction!(drivers_in_files::run_driver_trial, m)?)?;
    m.add_function(wrap_pyfunction!(replaying::replay, m)?)?;
    m.add_function(wrap_pyfunction!(replaying::replay_modules, m)?)?;
    m.add_function(wrap_pyfunction!(serve::serve, m)?)?;
    m.add_function(wrap_pyfunction!(serve::socket_path, m)?)?;
    m.add_function(wrap_pyfunction!(serve::token_new, m)?)?;
    m.add_function(wrap_pyfunction!(serve::token_list, m)?)?;
    m.add_function(wrap_pyfunction!(serve::token_revoke, m)?)?;
    Ok(())
}
