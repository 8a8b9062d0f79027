// SPDX-License-Identifier: Apache-2.0
//! Every call on a system by its name, with its arguments as a JSON object.
use crate::arguments::{Answer, Arguments, done, told};
use crate::cell::cell;
use crate::recordings::recordings;
use crate::values::{history, read};
use crate::waits::{Answered, wait};
use indexmap::IndexMap;
use model::configuration::SourceKind;
use model::definition::{Application, DeviceType, Graph, Verb};
use model::refusal::{Class, Place, Refusal, Refusals};
use model::value::Value;
use model::{Drawing, PortName};
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use std::time::Duration;
use supervisor::{DeviceRequest, Limits, Location, Patience, SvvRequest, System};

/// The interpreter that tries a code module in a process of its own, where no `opengpac-probe` lies beside the program.
const PYTHON: &str = "python3";

/// How long a wait sleeps before it looks at its deadline again.
const SLICE: Duration = Duration::from_millis(50);

/// Makes one call. `arguments`: the JSON text of an object, empty for none; the result is JSON.
///
/// The header `opengpac_ps.h` lists the calls and their arguments. Calls that wait return when what they wait for has come, or their
/// `timeout_ns` has passed, on the system's clock; under the virtual clock they advance time. Errors: the refusals of the
/// supervisor, `CallError` for a call or an argument that there is not.
pub fn call(system: &System, name: &str, arguments: &str) -> Result<Json, Refusals> {
    let mut answered = begin(system, name, arguments, SLICE)?;
    loop {
        match answered {
            Answered::Done(result) => return Ok(result),
            Answered::Waiting { call, arguments } => answered = begin(system, call, &arguments.to_string(), SLICE)?,
        }
    }
}

/// Begins a call: as [`call`], but one that lasts answers after `slice` of real time at the latest, with the call by which it goes on.
pub fn begin(system: &System, name: &str, arguments: &str, slice: Duration) -> Result<Answered, Refusals> {
    let mut a = Arguments::of(name, arguments)?;
    if let Some(answered) = wait(system, name, &mut a, slice)? {
        return Ok(answered);
    }
    for group in [configuration, software, devices, instances, commands, observation, recordings, time, cell] {
        if let Some(result) = group(system, name, &mut a)? {
            return Ok(Answered::Done(result));
        }
    }
    Err(vec![Refusal::new(Class::CallError, format!("there is no call '{name}'")).remedy("see the list in opengpac_ps.h")])
}

fn configuration(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "processor" => {
            let (processor, core, supervisor) = (a.take::<String>("name")?, a.or("core")?, a.or("supervisor")?);
            let location = Location::of(&processor, a.or("process")?, a.or("host")?)?;
            let patience = Patience { lost_after_ns: a.or("lost_after_ns")?, patience_ns: a.or("patience_ns")? };
            a.none_left()?;
            done(system.processor_within(&processor, core, supervisor, location, patience))
        }
        "listen" => {
            let (endpoint, name) = (a.take::<String>("endpoint")?, a.take::<String>("name")?);
            let mut options = json!({ "endpoint": endpoint, "name": name });
            for what in ["authority", "certificate", "key", "token", "clock_limit_ns"] {
                let given = a.or::<Json>(what)?;
                if !given.is_null() {
                    options[what] = given;
                }
            }
            a.none_left()?;
            done(system.listen(&options.to_string()))
        }
        "source" => {
            let (processor, source, kind) = (a.take::<String>("processor")?, a.take::<String>("name")?, a.take::<String>("kind")?);
            let (period_ns, priority, cost_ns) = (a.or("period_ns")?, a.take("priority")?, a.or("virtual_cost_ns")?);
            a.none_left()?;
            done(system.source(&processor, &source, source_kind(&kind, period_ns)?, priority, cost_ns))
        }
        "request" => {
            let source = a.take::<String>("source")?;
            a.none_left()?;
            done(system.request(&source))
        }
        "physical_device" => {
            let (processor, device, kind) = (a.take::<String>("processor")?, a.take::<String>("name")?, a.take::<String>("kind")?);
            let (options, source, place) = (a.or::<Json>("options")?, a.take::<String>("source")?, a.or::<Option<Place>>("place")?);
            a.none_left()?;
            let options = if options.is_null() { json!({}) } else { options };
            told(system.physical_device(&processor, &device, &kind, &options, &source, place)?)
        }
        "reopen_physical_device" => {
            let device = a.take::<String>("name")?;
            a.none_left()?;
            done(system.reopen(&device))
        }
        "delete_physical_device" => {
            let device = a.take::<String>("name")?;
            a.none_left()?;
            done(system.delete_physical_device(&device))
        }
        "take_over" => {
            a.none_left()?;
            told(system.take_over()?)
        }
        "place" => done(system.place(a.whole::<IndexMap<String, String>>()?)),
        _ => Ok(None),
    }
}

/// The kind of an interrupt source by its name; a timer has a period.
pub fn source_kind(kind: &str, period_ns: u64) -> Result<SourceKind, Refusals> {
    match kind {
        "timer" => Ok(SourceKind::Timer { period_ns }),
        "trigger" => Ok(SourceKind::Trigger),
        "software" => Ok(SourceKind::Software),
        other => Err(vec![
            Refusal::new(Class::DefinitionError, format!("there is no kind of source '{other}'")).remedy("take \"timer\", \"trigger\" or \"software\""),
        ]),
    }
}

fn software(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "download" => {
            let (path, module, python) = (a.take::<PathBuf>("path")?, a.or::<Option<String>>("name")?, a.or::<Option<String>>("python")?);
            a.none_left()?;
            told(system.download(&path, module.as_deref(), python.as_deref().unwrap_or(PYTHON))?)
        }
        "define_verb" => done(system.define_verb(a.whole::<Verb>()?)),
        "check_graph" => done(system.check_graph(&a.whole::<Graph>()?)),
        "check_definition" => told(system.check_definition(&a.whole::<Drawing>()?)?),
        "compatible" => {
            let (from, to) = (a.take::<PortName>("from")?, a.or::<Option<PortName>>("to")?);
            let drawing = a.whole::<Drawing>()?;
            match to {
                Some(to) => told(system.compatible(&drawing, &from, &to)?),
                None => told(system.compatible_with(&drawing, &from)?),
            }
        }
        "define_device_type" => done(system.define_device_type(a.whole::<DeviceType>()?)),
        "svv" => {
            let (svv, place) = (a.take::<String>("name")?, a.or::<Option<Place>>("place")?);
            done(system.svv(&svv, &a.whole::<SvvRequest>()?, place))
        }
        "delete_svv" => {
            let svv = a.take::<String>("name")?;
            a.none_left()?;
            done(system.delete_svv(&svv))
        }
        _ => Ok(None),
    }
}

fn devices(system: &System, name: &str, a: &mut Arguments) -> Answer {
    if !matches!(name, "device" | "enable" | "delete_device" | "device_state" | "device_parameter" | "set_device_parameter") {
        return Ok(None);
    }
    let device = a.take::<String>("name")?;
    if name == "device" {
        return done(system.device(&device, a.whole::<DeviceRequest>()?));
    }
    let (parameter, value) = (a.or::<String>("parameter")?, a.or::<Option<Value>>("value")?);
    a.none_left()?;
    match name {
        "enable" => told(system.enable(&device)?),
        "delete_device" => done(system.delete_device(&device)),
        "device_state" => told(system.device_state(&device)?),
        "device_parameter" => told(system.device_parameter(&device, &parameter)?),
        _ => match value {
            Some(value) => done(system.set_device_parameter(&device, &parameter, value)),
            None => Err(vec![Refusal::new(Class::CallError, format!("call '{name}' needs the argument 'value'"))]),
        },
    }
}

fn instances(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "check" => told(system.check(&a.whole::<Application>()?)?),
        "create" => told(system.create(&a.whole::<Application>()?)?),
        "start" => {
            let (instance, values, limits) = (a.take("instance")?, a.or::<IndexMap<String, Value>>("values")?, a.or::<Limits>("limits")?);
            a.none_left()?;
            done(system.start(instance, &values, limits))
        }
        "set" => {
            let (instance, values, every) = (a.take("instance")?, a.or("values")?, a.or("every_ns")?);
            a.none_left()?;
            done(system.set(instance, &values, &every))
        }
        _ => Ok(None),
    }
}

fn commands(system: &System, name: &str, a: &mut Arguments) -> Answer {
    if !matches!(name, "instance" | "suspend" | "resume" | "report" | "state" | "delete") {
        return Ok(None);
    }
    let instance = a.take("instance")?;
    a.none_left()?;
    match name {
        "instance" => told(system.instance_json(instance)?),
        "suspend" => done(system.suspend(instance)),
        "resume" => done(system.resume(instance)),
        "report" => told(system.report(instance)?),
        "state" => told(system.state(instance)),
        _ => done(system.delete(instance)),
    }
}

fn observation(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "read" => {
            let (names, raw) = (a.take::<Vec<String>>("names")?, a.or("raw")?);
            a.none_left()?;
            read(system, &names, raw).map(Some)
        }
        "write" => {
            let (svv, value) = (a.take::<String>("name")?, a.take::<Value>("value")?);
            a.none_left()?;
            done(system.write(&svv, &value))
        }
        "history" => {
            let (svv, count, raw) = (a.take::<String>("name")?, a.take("count")?, a.or("raw")?);
            a.none_left()?;
            history(system, &svv, count, raw).map(Some)
        }
        "svv_about" => {
            let svv = a.take::<String>("name")?;
            a.none_left()?;
            told(system.svv_json(&svv)?)
        }
        "log" => {
            let since = a.or("since")?;
            a.none_left()?;
            told(system.log_since(since))
        }
        "probe" => {
            let (source, for_ns) = (a.or::<Option<String>>("source")?, a.take("for_ns")?);
            a.none_left()?;
            done(system.probe(source.as_deref(), for_ns))
        }
        "library" => a.none_left().map(|()| Some(system.blocks_json())),
        "statistics" => a.none_left().map(|()| Some(system.statistics_json())),
        "names" => a.none_left().map(|()| Some(system.names_json())),
        _ => Ok(None),
    }
}

fn time(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "now" => {
            a.none_left()?;
            told(system.now_ns())
        }
        "step" => {
            a.none_left()?;
            told(system.step()?)
        }
        _ => Ok(None),
    }
}
