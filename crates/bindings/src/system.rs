// SPDX-License-Identifier: Apache-2.0
//! `_native.System`: one call of the supervisor each. Calls that wait release the interpreter and look at signals.
#![allow(clippy::too_many_arguments, reason = "the arguments are those of the Python calls")]
use crate::SLICE;
use crate::convert::{from_json, interpreter, refused, to_json};
use indexmap::IndexMap;
use model::definition::{Application, DeviceType, Graph, Verb};
use model::refusal::{Place, Refusals};
use model::value::Value;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use supervisor::{Alarm, AlarmText, DeviceRequest, InProcess, Limits, Location, Mode, Patience, SvvRequest, Waited};

/// One real-time system, embedded in this process.
#[pyclass(frozen, module = "opengpac._native")]
pub struct System {
    inner: Arc<supervisor::System>,
}

impl System {
    /// The system itself, for who serves it.
    pub fn shared(&self) -> Arc<supervisor::System> {
        self.inner.clone()
    }
}

/// Waits in slices, so that Ctrl-C ends it.
fn in_slices<T: Send>(py: Python<'_>, mut wait: impl FnMut(Duration) -> Result<Waited<T>, Refusals> + Send) -> PyResult<Option<T>> {
    loop {
        match py.detach(|| wait(SLICE)).map_err(refused)? {
            Waited::Done(result) => return Ok(Some(result)),
            Waited::TimedOut => return Ok(None),
            Waited::Slice => py.check_signals()?,
        }
    }
}

/// `process=` as Python gives it.
#[derive(FromPyObject)]
enum OwnOrNamed {
    Own(bool),
    Named(String),
}

#[pymethods]
impl System {
    #[new]
    fn new(name: &str, clock: &str, options_json: &str) -> PyResult<Self> {
        let inner = session::open(name, clock, options_json).map_err(refused)?;
        Ok(System { inner: Arc::new(inner) })
    }

    #[pyo3(signature = (name, core, supervisor, process, host, lost_after_ns=None, patience_ns=None))]
    fn processor(
        &self,
        py: Python<'_>,
        name: &str,
        core: Option<usize>,
        supervisor: bool,
        process: OwnOrNamed,
        host: Option<String>,
        lost_after_ns: Option<u64>,
        patience_ns: Option<u64>,
    ) -> PyResult<()> {
        let patience = Patience { lost_after_ns, patience_ns };
        let process = match process {
            OwnOrNamed::Own(own) => InProcess::Own(own),
            OwnOrNamed::Named(process) => InProcess::Named(process),
        };
        py.detach(|| self.inner.processor_within(name, core, supervisor, Location::of(name, process, host)?, patience)).map_err(refused)
    }

    fn source(&self, py: Python<'_>, processor: &str, name: &str, kind: &str, period_ns: u64, priority: u8, virtual_cost_ns: u64) -> PyResult<()> {
        let kind = session::source_kind(kind, period_ns).map_err(refused)?;
        py.detach(|| self.inner.source(processor, name, kind, priority, virtual_cost_ns)).map_err(refused)
    }

    fn request(&self, source: &str) -> PyResult<()> {
        self.inner.as_program("request", source, 0, || self.inner.request(source)).map_err(refused)
    }

    fn listen(&self, py: Python<'_>, options_json: &str) -> PyResult<()> {
        py.detach(|| self.inner.listen(options_json)).map_err(refused)
    }

    fn take_over(&self, py: Python<'_>) -> PyResult<String> {
        to_json(&py.detach(|| self.inner.take_over()).map_err(refused)?)
    }

    #[pyo3(name = "raise_source")]
    fn raise(&self, py: Python<'_>, device: &str, channel: &str, source: &str, place_json: &str) -> PyResult<()> {
        let place: Option<Place> = from_json(place_json)?;
        py.detach(|| self.inner.raise(device, channel, source, place)).map_err(refused)
    }

    fn physical_device(&self, py: Python<'_>, processor: &str, name: &str, kind: &str, options_json: &str, source: &str, place_json: &str) -> PyResult<String> {
        let options: serde_json::Value = from_json(options_json)?;
        let place: Option<Place> = from_json(place_json)?;
        let opened = py.detach(|| self.inner.physical_device(processor, name, kind, &options, source, place)).map_err(refused)?;
        to_json(&opened)
    }

    fn reopen_physical_device(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        py.detach(|| self.inner.as_program("reopen_physical_device", name, 0, || self.inner.reopen(name))).map_err(refused)
    }

    fn delete_physical_device(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        py.detach(|| self.inner.delete_physical_device(name)).map_err(refused)
    }

    fn download(&self, py: Python<'_>, path: PathBuf, name: Option<&str>) -> PyResult<String> {
        let python = interpreter(py)?;
        let module = py.detach(|| self.inner.download(&path, name, &python)).map_err(refused)?;
        to_json(&module)
    }

    fn place(&self, placement_json: &str) -> PyResult<()> {
        self.inner.place(from_json(placement_json)?).map_err(refused)
    }

    fn define_verb(&self, py: Python<'_>, verb_json: &str) -> PyResult<()> {
        let verb: Verb = from_json(verb_json)?;
        py.detach(|| self.inner.define_verb(verb)).map_err(refused)
    }

    fn check_graph(&self, graph_json: &str) -> PyResult<()> {
        let graph: Graph = from_json(graph_json)?;
        self.inner.check_graph(&graph).map_err(refused)
    }

    fn check_definition(&self, drawing_json: &str) -> PyResult<String> {
        to_json(&self.inner.check_definition(&from_json(drawing_json)?).map_err(refused)?)
    }

    fn compatible(&self, drawing_json: &str, source_json: &str, sink_json: &str) -> PyResult<String> {
        let (drawing, from) = (from_json(drawing_json)?, from_json(source_json)?);
        match from_json::<Option<model::PortName>>(sink_json)? {
            Some(to) => to_json(&self.inner.compatible(&drawing, &from, &to).map_err(refused)?),
            None => to_json(&self.inner.compatible_with(&drawing, &from).map_err(refused)?),
        }
    }

    fn compose(&self, composition_json: &str) -> PyResult<String> {
        to_json(&self.inner.compose(&from_json(composition_json)?).map_err(refused)?)
    }

    fn define_device_type(&self, type_json: &str) -> PyResult<()> {
        let of: DeviceType = from_json(type_json)?;
        self.inner.define_device_type(of).map_err(refused)
    }

    fn svv(&self, name: &str, specification_json: &str, place_json: &str) -> PyResult<()> {
        let request: SvvRequest = from_json(specification_json)?;
        self.inner.svv(name, &request, from_json(place_json)?).map_err(refused)
    }

    fn delete_svv(&self, name: &str) -> PyResult<()> {
        self.inner.delete_svv(name).map_err(refused)
    }

    fn device(&self, py: Python<'_>, name: &str, device_json: &str) -> PyResult<()> {
        let request: DeviceRequest = from_json(device_json)?;
        py.detach(|| self.inner.device(name, request)).map_err(refused)
    }

    fn enable(&self, py: Python<'_>, device: &str) -> PyResult<u64> {
        py.detach(|| self.inner.as_program("enable", device, 0, || self.inner.enable(device))).map_err(refused)
    }

    fn disable(&self, py: Python<'_>, device: &str) -> PyResult<()> {
        let mut is_first = true;
        in_slices(py, |slice| {
            let disable = || self.inner.disable(device, slice);
            if std::mem::take(&mut is_first) { self.inner.as_program("disable", device, 0, disable) } else { disable() }
        })?;
        Ok(())
    }

    fn exchange_verb(&self, py: Python<'_>, device: &str, verb: &str, place_json: &str) -> PyResult<()> {
        let place = from_json(place_json)?;
        py.detach(|| self.inner.as_program("exchange_verb", device, 0, || self.inner.exchange_verb(device, verb, place))).map_err(refused)
    }

    fn delete_device(&self, py: Python<'_>, device: &str) -> PyResult<()> {
        py.detach(|| self.inner.delete_device(device)).map_err(refused)
    }

    fn device_state(&self, device: &str) -> PyResult<&'static str> {
        self.inner.device_state(device).map_err(refused)
    }

    fn wait_enabled(&self, py: Python<'_>, device: &str, timeout_ns: Option<i64>) -> PyResult<bool> {
        let until_ns = timeout_ns.map(|t| self.inner.now_ns() + t);
        Ok(in_slices(py, |slice| self.inner.wait_enabled(device, until_ns, slice))?.unwrap_or(false))
    }

    fn set_device_parameter(&self, py: Python<'_>, device: &str, parameter: &str, value_json: &str) -> PyResult<()> {
        let value: Value = from_json(value_json)?;
        py.detach(|| self.inner.as_program("set_device_parameter", device, 0, || self.inner.set_device_parameter(device, parameter, value))).map_err(refused)
    }

    fn device_parameter(&self, device: &str, parameter: &str) -> PyResult<String> {
        to_json(&self.inner.device_parameter(device, parameter).map_err(refused)?)
    }

    fn check(&self, py: Python<'_>, application_json: &str) -> PyResult<String> {
        let application: Application = from_json(application_json)?;
        let plan = py.detach(|| self.inner.check(&application)).map_err(refused)?;
        to_json(&plan)
    }

    fn create(&self, py: Python<'_>, application_json: &str) -> PyResult<u64> {
        let application: Application = from_json(application_json)?;
        py.detach(|| self.inner.create(&application)).map_err(refused)
    }

    fn instance_json(&self, instance: u64) -> PyResult<String> {
        to_json(&self.inner.instance_json(instance).map_err(refused)?)
    }

    fn start(&self, py: Python<'_>, instance: u64, values_json: &str, options_json: &str) -> PyResult<()> {
        let values: IndexMap<String, Value> = from_json(values_json)?;
        let limits: Limits = from_json(options_json)?;
        py.detach(|| self.inner.as_program("start", "", instance, || self.inner.start(instance, &values, limits))).map_err(refused)
    }

    fn suspend(&self, py: Python<'_>, instance: u64) -> PyResult<()> {
        py.detach(|| self.inner.as_program("suspend", "", instance, || self.inner.suspend(instance))).map_err(refused)
    }

    fn resume(&self, py: Python<'_>, instance: u64) -> PyResult<()> {
        py.detach(|| self.inner.as_program("resume", "", instance, || self.inner.resume(instance))).map_err(refused)
    }

    fn halt(&self, py: Python<'_>, instance: u64) -> PyResult<()> {
        py.detach(|| self.inner.as_program("halt", "", instance, || self.inner.halt(instance))).map_err(refused)?;
        in_slices(py, |slice| self.inner.wait(instance, None, slice))?;
        Ok(())
    }

    fn wait(&self, py: Python<'_>, instance: u64, timeout_ns: Option<i64>, slice_ns: u64) -> PyResult<Option<String>> {
        let until_ns = timeout_ns.map(|t| self.inner.now_ns() + t);
        let report = if slice_ns == 0 {
            in_slices(py, |slice| self.inner.wait(instance, until_ns, slice))?
        } else {
            let waited = py.detach(|| self.inner.wait(instance, until_ns, Duration::from_nanos(slice_ns))).map_err(refused)?;
            py.check_signals()?;
            if let Waited::Done(report) = waited { Some(report) } else { None }
        };
        report.map(|r| to_json(&r)).transpose()
    }

    fn report(&self, instance: u64) -> PyResult<Option<String>> {
        self.inner.report(instance).map_err(refused)?.map(|r| to_json(&r)).transpose()
    }

    fn state(&self, instance: u64) -> &'static str {
        self.inner.state(instance)
    }

    fn delete(&self, py: Python<'_>, instance: u64) -> PyResult<()> {
        py.detach(|| self.inner.delete(instance)).map_err(refused)
    }

    fn set(&self, py: Python<'_>, instance: u64, values_json: &str, every_json: &str) -> PyResult<()> {
        let values: IndexMap<String, Value> = from_json(values_json)?;
        let every: IndexMap<String, u64> = from_json(every_json)?;
        py.detach(|| self.inner.as_program("set", "", instance, || self.inner.set(instance, &values, &every))).map_err(refused)
    }

    fn ended_fd(&self) -> i32 {
        self.inner.ended_fd()
    }

    #[allow(clippy::type_complexity, reason = "the tuple is the Python face")]
    fn read<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<(i64, Vec<(Bound<'py, PyBytes>, u64, i64)>)> {
        let (time_ns, readings) = py.detach(|| self.inner.read(&names)).map_err(refused)?;
        let readings = readings.into_iter().map(|(bytes, number, at)| (PyBytes::new(py, &bytes), number, at)).collect();
        Ok((time_ns, readings))
    }

    fn write(&self, py: Python<'_>, name: &str, value_json: &str) -> PyResult<()> {
        let value: Value = from_json(value_json)?;
        py.detach(|| self.inner.as_program("write", name, 0, || self.inner.write(name, &value))).map_err(refused)
    }

    fn history<'py>(&self, py: Python<'py>, name: &str, count: usize) -> PyResult<Vec<(u64, i64, Bound<'py, PyBytes>)>> {
        let values = py.detach(|| self.inner.history(name, count)).map_err(refused)?;
        Ok(values.into_iter().map(|(number, at, bytes)| (number, at, PyBytes::new(py, &bytes))).collect())
    }

    fn svv_json(&self, name: &str) -> PyResult<String> {
        to_json(&self.inner.svv_json(name).map_err(refused)?)
    }

    fn now(&self) -> i64 {
        self.inner.now_ns()
    }

    fn advance(&self, py: Python<'_>, duration_ns: i64) -> PyResult<()> {
        let end_ns = self.inner.now_ns().saturating_add(duration_ns.max(0));
        while self.inner.now_ns() < end_ns {
            let slice_ns = (end_ns - self.inner.now_ns()).min(ADVANCE_SLICE_NS);
            py.detach(|| self.inner.advance(slice_ns)).map_err(refused)?;
            py.check_signals()?;
        }
        Ok(())
    }

    fn step(&self, py: Python<'_>) -> PyResult<bool> {
        py.detach(|| self.inner.step()).map_err(refused)
    }

    fn emergency_stop(&self, py: Python<'_>, reason: &str) -> PyResult<()> {
        py.detach(|| self.inner.as_program("emergency_stop", "system", 0, || self.inner.emergency_stop(reason))).map_err(refused)
    }

    fn emergency_stop_input(&self, device: &str, channel: &str, at_zero: bool) -> PyResult<()> {
        self.inner.emergency_stop_input(device, channel, at_zero).map_err(refused)
    }

    fn reset(&self) -> PyResult<()> {
        self.inner.as_program("reset", "system", 0, || self.inner.reset()).map_err(refused)
    }

    fn pause(&self, py: Python<'_>, devices: Option<Vec<String>>) -> PyResult<Vec<String>> {
        let stopped = py.detach(|| self.inner.as_program("pause", "system", 0, || self.inner.pause(devices.as_deref()))).map_err(refused)?;
        let (ids, names): (Vec<u64>, Vec<String>) = stopped.into_iter().unzip();
        in_slices(py, |slice| self.inner.paused(&ids, slice))?;
        Ok(names)
    }

    fn resume_program(&self, py: Python<'_>, devices: Option<Vec<String>>) -> PyResult<Vec<String>> {
        let going = py.detach(|| self.inner.as_program("resume_program", "system", 0, || self.inner.resume_program(devices.as_deref()))).map_err(refused)?;
        Ok(going.into_iter().map(|(_, name)| name).collect())
    }

    fn mode(&self) -> &'static str {
        self.inner.mode()
    }

    fn set_mode(&self, py: Python<'_>, mode_json: &str) -> PyResult<()> {
        let mode: Mode = from_json(mode_json)?;
        py.detach(|| self.inner.as_program("set_mode", "system", 0, || self.inner.set_mode(mode))).map_err(refused)
    }

    fn enabling_switch(&self, device: &str, channel: &str) -> PyResult<()> {
        self.inner.enabling_switch(device, channel).map_err(refused)
    }

    fn define_alarm(&self, code: &str, text_json: &str) -> PyResult<()> {
        let text: AlarmText = from_json(text_json)?;
        self.inner.define_alarm(code, text).map_err(refused)
    }

    fn raise_alarm(&self, py: Python<'_>, code: &str, source: &str, text: &str) -> PyResult<()> {
        py.detach(|| self.inner.as_program("raise_alarm", code, 0, || self.inner.raise_alarm(code, source, text))).map_err(refused)
    }

    fn clear_alarm(&self, py: Python<'_>, code: &str, source: Option<&str>) -> PyResult<bool> {
        py.detach(|| self.inner.as_program("clear_alarm", code, 0, || self.inner.clear_alarm(code, source))).map_err(refused)
    }

    fn acknowledge_alarms(&self, py: Python<'_>, number: Option<u64>) -> PyResult<usize> {
        py.detach(|| self.inner.as_program("acknowledge_alarms", "system", 0, || self.inner.acknowledge_alarms(number))).map_err(refused)
    }

    fn alarms_json(&self) -> PyResult<String> {
        to_json(&self.inner.alarms_json())
    }

    fn restore_alarms(&self, history_json: &str) -> PyResult<()> {
        let history: Vec<Alarm> = from_json(history_json)?;
        self.inner.restore_alarms(history).map_err(refused)
    }

    fn statistics_json(&self) -> PyResult<String> {
        to_json(&self.inner.statistics_json())
    }

    #[pyo3(signature = (source, for_ns))]
    fn probe(&self, source: Option<&str>, for_ns: u64) -> PyResult<()> {
        self.inner.probe(source, for_ns).map_err(refused)
    }

    fn verbs_json(&self) -> PyResult<String> {
        to_json(&self.inner.verbs_json())
    }

    fn names_json(&self) -> PyResult<String> {
        to_json(&self.inner.names_json())
    }

    fn configuration_json(&self) -> PyResult<String> {
        to_json(&self.inner.configuration_json())
    }

    fn installed_json(&self, py: Python<'_>) -> PyResult<String> {
        to_json(&py.detach(|| self.inner.installed_json()))
    }

    fn verb_form_json(&self, name: &str) -> PyResult<String> {
        to_json(&self.inner.verb_form_json(name).map_err(refused)?)
    }

    fn geometry_json(&self, py: Python<'_>, device: &str) -> PyResult<String> {
        to_json(&py.detach(|| self.inner.geometry_json(device)).map_err(refused)?)
    }

    fn log_json(&self, since: u64) -> PyResult<String> {
        to_json(&self.inner.log_since(since))
    }

    fn record(&self, py: Python<'_>, path: PathBuf, options_json: &str) -> PyResult<u64> {
        let options = from_json(options_json)?;
        py.detach(|| session::record(&self.inner, &path, options)).map_err(refused)
    }

    fn recording_json(&self, number: u64) -> PyResult<String> {
        to_json(&session::recording(&self.inner, number).map_err(refused)?)
    }

    fn stop_recording(&self, py: Python<'_>, number: u64) -> PyResult<String> {
        loop {
            let summary = py.detach(|| session::end_recording(&self.inner, number, SLICE)).map_err(refused)?;
            if !summary.running {
                return to_json(&summary);
            }
            py.check_signals()?;
        }
    }

    fn close(&self, py: Python<'_>) {
        py.detach(|| self.inner.close());
    }
}

/// Virtual time between two looks at signals.
const ADVANCE_SLICE_NS: i64 = 100_000_000;
