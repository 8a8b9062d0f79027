// SPDX-License-Identifier: Apache-2.0
//! JSON Schemas of the calls, derived from their declarations, and of the other requests.
use crate::definitions::unite;
use crate::frames::StreamFrame;
use crate::told::StreamAnswer;
use crate::version::Version;
use daemon::calls::{self, Call};
use daemon::files::StoredFile;
use daemon::requests::{AskForCommand, DeclineRequest, HandOver, OpenSession, TakeCommand, WithdrawRequest};
use daemon::{Holder, Reports, SessionAnswer, SessionInfo};
use model::refusal::Refusal;
use schemars::{JsonSchema, SchemaGenerator, generate::SchemaSettings};
use serde_json::{Map, Value, json};
use supervisor::ModuleAbout;

/// Returns all schemas, draft 2020-12: `{"version", "calls": {name: {"role", "subject", "words", "lasts", "arguments", "result"}},
/// "requests": {"METHOD path": {"body", "answer"}}, "errors", "$defs": {…}}`. `answer` describes the member `result`, or the whole answer
/// if the request has no such member.
pub fn all() -> Value {
    let mut sent = SchemaSettings::draft2020_12().into_generator();
    let mut answered = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let mut bodies = json!({
        "calls": calls::all().map(|call| (call.name.to_owned(), arguments(&mut sent, call))).collect::<Map<_, _>>(),
        "requests": {
            "POST /v1/sessions": sent.subschema_for::<OpenSession>(),
            "POST /v1/command": sent.subschema_for::<TakeCommand>(),
            "POST /v1/command/request": sent.subschema_for::<AskForCommand>(),
            "DELETE /v1/command/request": sent.subschema_for::<WithdrawRequest>(),
            "POST /v1/command/hand_over": sent.subschema_for::<HandOver>(),
            "POST /v1/command/decline": sent.subschema_for::<DeclineRequest>(),
            "GET /v1/stream": sent.subschema_for::<StreamFrame>(),
        },
    });
    let results: Map<String, Value> = calls::all().map(|call| (call.name.to_owned(), call.answer_schema(&mut answered).to_value())).collect();
    let answers = answers(&mut answered);
    let errors = json!({ "type": "object", "properties": { "errors": one::<Vec<Refusal>>(&mut answered) }, "required": ["errors"] });
    let definitions = unite(&mut bodies, sent.take_definitions(true), answered.take_definitions(true));
    let calls: Map<String, Value> = calls::all()
        .map(|call| {
            let described = json!({
                "role": call.role.word(), "subject": call.subject, "words": call.words(), "lasts": call.lasts,
                "arguments": bodies["calls"][call.name], "result": results[call.name],
            });
            (call.name.to_owned(), described)
        })
        .collect();
    let requests: Map<String, Value> =
        answers.into_iter().map(|(request, answer)| (request.to_owned(), json!({ "body": bodies["requests"].get(request), "answer": answer }))).collect();
    json!({ "version": 1, "calls": calls, "requests": requests, "errors": errors, "$defs": definitions })
}

/// Returns the schema of a call's arguments: an object of named arguments, a definition, or an object that contains both.
fn arguments(generator: &mut SchemaGenerator, call: &Call) -> Value {
    let mut named = call.named_schema(generator).to_value();
    if call.lasts {
        named["properties"]["slice_ms"] = json!({
            "description": "Time limit of this request, ms.", "type": "integer", "minimum": 1, "maximum": 1000, "default": 1000,
        });
    }
    let is_empty = named["properties"].as_object().is_none_or(Map::is_empty);
    match call.whole_schema(generator).map(Into::into) {
        None => {
            named["additionalProperties"] = json!(false);
            named
        }
        Some(whole) if is_empty => whole,
        Some(whole) => {
            named.as_object_mut().into_iter().for_each(|named| drop(named.remove("additionalProperties")));
            json!({ "allOf": [named, whole] })
        }
    }
}

/// Returns the schemas of the answers to requests that are not calls.
fn answers(of: &mut SchemaGenerator) -> Vec<(&'static str, Value)> {
    let document = || json!({ "type": "object" });
    vec![
        ("GET /v1/version", one::<Version>(of)),
        ("GET /v1/schema", document()),
        ("GET /v1/openapi.json", document()),
        ("GET /v1/sessions", one::<Vec<SessionInfo>>(of)),
        ("POST /v1/sessions", one::<SessionAnswer>(of)),
        ("DELETE /v1/sessions", one::<()>(of)),
        ("GET /v1/sessions/{name}/reports", one::<Reports>(of)),
        ("DELETE /v1/sessions/{name}/reports", one::<()>(of)),
        ("POST /v1/heartbeat", one::<()>(of)),
        ("GET /v1/hold", one::<()>(of)),
        ("GET /v1/command", one::<Holder>(of)),
        ("POST /v1/command", one::<Holder>(of)),
        ("DELETE /v1/command", one::<Holder>(of)),
        ("POST /v1/command/request", one::<Holder>(of)),
        ("DELETE /v1/command/request", one::<Holder>(of)),
        ("POST /v1/command/hand_over", one::<Holder>(of)),
        ("POST /v1/command/decline", one::<Holder>(of)),
        ("PUT /v1/modules/{name}", one::<ModuleAbout>(of)),
        ("GET /v1/files/{sha256}", one::<StoredFile>(of)),
        ("PUT /v1/files/{sha256}", one::<StoredFile>(of)),
        ("GET /v1/stream", one::<StreamAnswer>(of)),
    ]
}

fn one<T: JsonSchema>(generator: &mut SchemaGenerator) -> Value {
    generator.subschema_for::<T>().to_value()
}
