// SPDX-License-Identifier: Apache-2.0
//! JSON Schemas of the calls, made from the table of calls and the types themselves.
use crate::calls::{Argument, CALLS, Call, Of};
use crate::wire::{OpenSession, StreamFrame, TakeCommand};
use model::compose::Composition;
use model::definition::{Application, DeviceType, Graph, Verb};
use model::refusal::{Place, Refusal};
use model::{PortName, Verdict};
use schemars::{JsonSchema, SchemaGenerator, generate::SchemaSettings};
use serde_json::{Map, Value, json};
use supervisor::{Alarm, DeviceRequest, Entry, InProcess, Limits, Mode, Report, Severity, SvvRequest};

/// All schemas: `{"version", "calls": {name: {"role", "arguments", "result"}}, "requests": {name: schema}, "$defs": {…}}`, draft 2020-12.
pub fn all() -> Value {
    let mut generator = SchemaSettings::draft2020_12().into_generator();
    let calls: Map<String, Value> = CALLS.iter().map(|call| (call.name.to_owned(), of_call(&mut generator, call))).collect();
    let requests = json!({
        "POST /v1/sessions": generator.subschema_for::<OpenSession>(),
        "POST /v1/command": generator.subschema_for::<TakeCommand>(),
        "stream": generator.subschema_for::<StreamFrame>(),
        "errors": { "type": "object", "properties": { "errors": generator.subschema_for::<Vec<Refusal>>() }, "required": ["errors"] },
    });
    let definitions = generator.take_definitions(true);
    json!({ "version": 1, "calls": calls, "requests": requests, "$defs": definitions })
}

fn of_call(generator: &mut SchemaGenerator, call: &Call) -> Value {
    let mut properties: Map<String, Value> = call.arguments.iter().map(|a| (a.name.to_owned(), schema(generator, a.of))).collect();
    if call.lasts() {
        properties.insert("slice_ms".to_owned(), json!({ "type": "integer", "minimum": 1, "maximum": 1000, "default": 1000 }));
    }
    let required: Vec<&str> = call.arguments.iter().filter(|a| a.required).map(|a: &Argument| a.name).collect();
    let named = json!({ "type": "object", "properties": properties, "required": required });
    let arguments = match call.whole {
        None => {
            let mut named = named;
            named["additionalProperties"] = json!(false);
            named
        }
        Some(of) if call.arguments.is_empty() => schema(generator, of),
        Some(of) => json!({ "allOf": [named, schema(generator, of)] }),
    };
    json!({ "role": call.role.word(), "arguments": arguments, "result": schema(generator, call.result) })
}

fn one<T: JsonSchema>(generator: &mut SchemaGenerator) -> Value {
    generator.subschema_for::<T>().to_value()
}

/// A value with its number and time, as `value` or as `bytes`.
fn reading() -> Value {
    json!({
        "type": "object", "required": ["number", "time_ns"],
        "properties": {
            "value": true, "bytes": { "type": "string", "contentEncoding": "base64" }, "number": { "type": "integer" }, "time_ns": { "type": "integer" }
        },
    })
}

fn schema(generator: &mut SchemaGenerator, of: Of) -> Value {
    match of {
        Of::Nothing => json!({ "type": "null" }),
        Of::Any => json!(true),
        Of::Text => one::<String>(generator),
        Of::Int => json!({ "type": "integer" }),
        Of::Bool => one::<bool>(generator),
        Of::Names => one::<Vec<String>>(generator),
        Of::Numbers => json!({ "type": "array", "items": { "type": "integer", "minimum": 0 } }),
        Of::Map => json!({ "type": "object" }),
        Of::Intervals => json!({ "type": "object", "additionalProperties": { "type": "integer", "minimum": 0 } }),
        Of::Place => one::<Option<Place>>(generator),
        Of::InProcess => one::<InProcess>(generator),
        Of::Limits => one::<Limits>(generator),
        Of::Report => one::<Option<Report>>(generator),
        Of::Snapshot => json!({
            "type": "object", "required": ["time_ns", "values"],
            "properties": { "time_ns": { "type": "integer" }, "values": { "type": "object", "additionalProperties": reading() } },
        }),
        Of::History => json!({ "type": "array", "items": reading() }),
        Of::Log => one::<Vec<Entry>>(generator),
        Of::Alarms => one::<Vec<Alarm>>(generator),
        Of::Mode => one::<Mode>(generator),
        Of::Severity => one::<Severity>(generator),
        Of::Verb => one::<Verb>(generator),
        Of::Graph => one::<Graph>(generator),
        Of::Findings => one::<Vec<Refusal>>(generator),
        Of::Port => one::<PortName>(generator),
        Of::Wired => json!({ "anyOf": [generator.subschema_for::<Option<String>>(), generator.subschema_for::<Vec<Verdict>>()] }),
        Of::Composition => one::<Composition>(generator),
        Of::DeviceType => one::<DeviceType>(generator),
        Of::Device => one::<DeviceRequest>(generator),
        Of::Svv => one::<SvvRequest>(generator),
        Of::Application => one::<Application>(generator),
        Of::Placement => json!({ "type": "object", "additionalProperties": { "type": "string" } }),
    }
}
