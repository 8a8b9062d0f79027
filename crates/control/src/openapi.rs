// SPDX-License-Identifier: Apache-2.0
//! The OpenAPI document of the control interface. Its calls are derived from their declarations, its other paths from the table in this
//! module.
use crate::definitions::{DEFINITIONS, refer};
use serde_json::{Map, Value, json};

/// Path of the definitions in an OpenAPI document.
const COMPONENTS: &str = "#/components/schemas/";

/// A path that is not a call: method, path, parameters, and purpose. `schema.rs` declares its body and its answer, if any.
struct Other(&'static str, &'static str, &'static [Parameter], &'static str);

/// A parameter of a path: location, name, type, and meaning.
struct Parameter(ParameterPlace, &'static str, &'static str, &'static str);

#[derive(PartialEq)]
enum ParameterPlace {
    Path,
    Query,
    /// Required query parameter.
    Needed,
}

const SESSION_NAME: Parameter = Parameter(ParameterPlace::Path, "name", "string", "Name of the session.");
const SHA256: Parameter = Parameter(ParameterPlace::Path, "sha256", "string", "SHA-256 of the file, 64 lower-case hexadecimal digits.");

const OTHERS: &[Other] = &[
    Other("get", "/v1/version", &[], "Version, machine and system, and the role of the caller."),
    Other("get", "/v1/schema", &[], "JSON Schemas of all calls."),
    Other("get", "/v1/openapi.json", &[], "This document."),
    Other("get", "/v1/sessions", &[], "Lists the sessions."),
    Other("post", "/v1/sessions", &[], "Opens a session, takes over one that is alive, or returns to one that was lost."),
    Other("delete", "/v1/sessions", &[], "Closes the session of the header in order: its instances keep running."),
    Other("get", "/v1/sessions/{name}/reports", &[SESSION_NAME], "End reports that a session has not collected yet, oldest first."),
    Other(
        "delete",
        "/v1/sessions/{name}/reports",
        &[SESSION_NAME, Parameter(ParameterPlace::Needed, "through", "integer", "Number of the last report that is collected.")],
        "Collects end reports.",
    ),
    Other("post", "/v1/heartbeat", &[], "Heartbeat of the session of the header."),
    Other("get", "/v1/hold", &[], "Answers when the session is closed; if the connection breaks before, the session is lost."),
    Other("get", "/v1/command", &[], "The session in command, the pending requests for command, and the outcome of the latest ones."),
    Other("post", "/v1/command", &[], "Takes command."),
    Other("delete", "/v1/command", &[], "Gives command back; the longest-waiting request is then granted."),
    Other("post", "/v1/command/request", &[], "Requests command; granted at once if no session commands."),
    Other("delete", "/v1/command/request", &[], "Withdraws the request for command."),
    Other("post", "/v1/command/hand_over", &[], "Hands command over to another session."),
    Other("post", "/v1/command/decline", &[], "Declines the request of another session."),
    Other(
        "put",
        "/v1/modules/{name}",
        &[
            Parameter(ParameterPlace::Path, "name", "string", "Name of the module."),
            Parameter(ParameterPlace::Needed, "file", "string", "Name of the file; its suffix determines its kind."),
            Parameter(ParameterPlace::Needed, "sha256", "string", "SHA-256 of the body."),
            Parameter(ParameterPlace::Query, "abi", "integer", "For a shared object: version of the block interface."),
            Parameter(ParameterPlace::Query, "target", "string", "For a shared object: target machine."),
        ],
        "Downloads a code module: C or C++ source, or a shared object. Needs the role download.",
    ),
    Other("get", "/v1/files/{sha256}", &[SHA256], "Checks whether a file exists."),
    Other("put", "/v1/files/{sha256}", &[SHA256], "Stores a file by its content. Needs the role download."),
    Other(
        "get",
        "/v1/stream",
        &[Parameter(ParameterPlace::Query, "hold", "boolean", "If the stream breaks, the session of the header is lost.")],
        "A WebSocket: values, statistics, the log, ends and scopes to which its client subscribes. Its frames are `stream` of GET /v1/schema.",
    ),
];

/// Returns the document, OpenAPI 3.1.
pub fn document() -> Value {
    let schemas = crate::schema::all();
    let mut paths = Map::new();
    for (name, call) in schemas["calls"].as_object().into_iter().flatten() {
        paths.insert(format!("/v1/call/{name}"), json!({ "post": of_call(name, call) }));
    }
    for other in OTHERS {
        let path = paths.entry(other.1).or_insert_with(|| json!({}));
        path[other.0] = of_other(other, &schemas["requests"]);
    }
    let mut document = json!({
        "openapi": "3.1.0",
        "info": {
            "title": "OpenGPAC control interface",
            "version": schemas["version"].to_string(),
            "description": "Calls on a real-time system, and what they need: sessions, command, files, code. docs/control.md is the manual.",
            "license": { "name": "Apache-2.0", "identifier": "Apache-2.0" },
        },
        "servers": [{ "url": "/", "description": "opengpac rts" }],
        "security": [{}, { "token": [] }],
        "tags": tags(&schemas),
        "paths": paths,
        "components": {
            "schemas": schemas["$defs"],
            "securitySchemes": { "token": { "type": "http", "scheme": "bearer" } },
            "parameters": {
                "Session": {
                    "name": "OpenGPAC-Session", "in": "header", "required": false, "schema": { "type": "string" },
                    "description": "ID of the session that makes the request.",
                },
            },
            "responses": { "Refused": { "description": "Refused: the reason, and what to do.", "content": body(&schemas["errors"]) } },
        },
    });
    refer(&mut document, &|path| match path.strip_prefix(DEFINITIONS) {
        Some(name) => format!("{COMPONENTS}{name}"),
        None => path.to_owned(),
    });
    document
}

/// Returns the subjects of the calls, in order, followed by the subject of the other paths.
fn tags(schemas: &Value) -> Vec<Value> {
    let mut names: Vec<&str> = Vec::new();
    for subject in schemas["calls"].as_object().into_iter().flatten().filter_map(|(_, call)| call["subject"].as_str()).chain(["interface"]) {
        if !names.contains(&subject) {
            names.push(subject);
        }
    }
    names.into_iter().map(|name| json!({ "name": name })).collect()
}

fn body(schema: &Value) -> Value {
    json!({ "application/json": { "schema": schema } })
}

/// Returns the schema of `{"result": …}`, with the continuation if the call is long-running.
fn result(schema: &Value, lasts: bool) -> Value {
    let done = json!({ "type": "object", "properties": { "result": schema }, "required": ["result"] });
    if !lasts {
        return done;
    }
    let go_on =
        json!({ "type": "object", "properties": { "call": { "type": "string" }, "arguments": { "type": "object" } }, "required": ["call", "arguments"] });
    let waiting = json!({
        "type": "object",
        "properties": { "waiting": { "const": true }, "go_on": go_on, "now_ns": { "type": "integer" } },
        "required": ["waiting", "go_on", "now_ns"],
    });
    json!({ "anyOf": [done, waiting] })
}

fn responses(schema: &Value) -> Value {
    json!({
        "200": { "description": "Done.", "content": body(schema) },
        "default": { "$ref": "#/components/responses/Refused" },
    })
}

fn of_call(name: &str, call: &Value) -> Value {
    let words = call["words"].as_str().unwrap_or_default();
    json!({
        "operationId": name,
        "tags": [call["subject"]],
        "summary": words.split_inclusive(". ").next().unwrap_or_default().trim(),
        "description": format!("{words}\n\nNeeds the role {}.", call["role"].as_str().unwrap_or_default()),
        "parameters": [{ "$ref": "#/components/parameters/Session" }],
        "requestBody": { "content": body(&call["arguments"]), "required": call["arguments"]["required"].as_array().is_some_and(|names| !names.is_empty()) },
        "responses": responses(&result(&call["result"], call["lasts"] == true)),
    })
}

fn of_other(Other(method, path, parameters, words): &Other, requests: &Value) -> Value {
    let described = &requests[format!("{} {path}", method.to_uppercase())];
    let given = parameters.iter().map(|Parameter(place, name, of, words)| {
        let at = if *place == ParameterPlace::Path { "path" } else { "query" };
        json!({ "name": name, "in": at, "required": *place != ParameterPlace::Query, "description": words, "schema": { "type": of } })
    });
    let session = [json!({ "$ref": "#/components/parameters/Session" })];
    let mut operation = json!({
        "operationId": format!("{method} {path}"), "tags": ["interface"], "summary": words, "parameters": given.chain(session).collect::<Vec<_>>(),
    });
    if *path == "/v1/stream" {
        operation["responses"] = json!({ "101": { "description": "The WebSocket." }, "default": { "$ref": "#/components/responses/Refused" } });
        return operation;
    }
    let plain = matches!(*path, "/v1/version" | "/v1/schema" | "/v1/openapi.json");
    operation["responses"] = responses(&if plain { described["answer"].clone() } else { result(&described["answer"], false) });
    if *method == "put" {
        operation["requestBody"] =
            json!({ "required": true, "content": { "application/octet-stream": { "schema": { "type": "string", "format": "binary" } } } });
    } else if described["body"].is_object() {
        operation["requestBody"] = json!({ "required": true, "content": body(&described["body"]) });
    }
    operation
}
