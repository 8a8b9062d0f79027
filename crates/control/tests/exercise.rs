// SPDX-License-Identifier: Apache-2.0
//! A call added as an exercise: it is declared only here, and appears everywhere.
//!
//! Runs in its own process, since a call is registered for the life of the process.
use api::Role;
use axum::body::{Body, to_bytes};
use axum::http::Request;
use control::{Inside, Options};
use daemon::Peer;
use serde_json::{Value as Json, json};
use std::io::Write;
use std::process::{Command, Stdio};
use std::sync::Arc;
use tower::ServiceExt;

api::calls! {
    /// Calls that are declared outside `api`.
    const EXERCISE about "exercise" = [
        /// Counts the SVVs of a pattern. Returns how many there are.
        Configure count_lamps(
            /// Prefix of their names.
            must prefix: String,
            /// No more than these.
            may most: Option<u64>,
        ) -> u64: commands("prefix"), told, replaces(&["prefix"])
            => |system| {
                let names = serde_json::to_value(system.names()).unwrap_or_default();
                let count = names["svvs"].as_array().map_or(0, |svvs| svvs.iter().filter(|name| name.as_str().is_some_and(|n| n.starts_with(&prefix))).count());
                Ok::<u64, api::Refusals>(most.map_or(count as u64, |most| most.min(count as u64)))
            };
    ];
}

/// Returns a system with two SVVs and its interface; callers are the user of this process.
fn served() -> (Arc<supervisor::System>, Inside) {
    let system = Arc::new(api::open("cell", "virtual", "{}").unwrap_or_else(|r| panic!("{r:?}")));
    for name in ["lamp.red", "lamp.green"] {
        let svv = json!({ "name": name, "type_text": "bool" });
        api::call(&system, "svv", &svv.to_string()).unwrap_or_else(|r| panic!("{r:?}"));
    }
    let inside = Inside::new(system.clone(), &Options::default()).unwrap_or_else(|r| panic!("{r:?}"));
    (system, inside)
}

async fn ask(inside: &Inside, session: &str, path: &str, body: &str) -> (u16, Json) {
    let request = Request::post(path).header("host", "localhost").extension(Peer::Unix { uid: 0 });
    let request = if session.is_empty() { request } else { request.header("opengpac-session", session) };
    let request = request.body(Body::from(body.to_owned()));
    let answer = inside.router().oneshot(request.expect("a request")).await.expect("it is answered");
    let status = answer.status().as_u16();
    let text = to_bytes(answer.into_body(), usize::MAX).await.expect("a body");
    (status, serde_json::from_slice(&text).expect("JSON"))
}

#[tokio::test]
async fn a_call_is_declared_once_and_is_everywhere() {
    let before = (api::generate::header(api::calls()), api::generate::page(api::calls()), api::generate::python(api::calls()));
    api::add(EXERCISE);
    let (system, inside) = served();
    // In process, by text, with a message for each error.
    assert_eq!(api::call(&system, "count_lamps", r#"{"prefix": "lamp."}"#).expect("two"), 2);
    let wrong = |arguments: &str| api::call(&system, "count_lamps", arguments).expect_err("refused")[0].message.clone();
    assert!(wrong("{}").contains("argument 'prefix' of call 'count_lamps'"), "{}", wrong("{}"));
    assert_eq!(wrong(r#"{"prefix": "", "least": 1}"#), "call 'count_lamps' has no argument 'least'");
    // As the embedded system of Python calls it: the log contains it.
    let call = api::known("count_lamps").expect("it is there");
    let told = call.begin_as_program(&system, r#"{"prefix": "lamp.", "most": 1}"#, std::time::Duration::ZERO).expect("one");
    assert_eq!(told, api::CallResult::Done("1".to_owned()));
    assert!(system.log_since(0).iter().any(|entry| entry.kind == "command" && entry.text == "count_lamps" && entry.about == "lamp."));
    over_http(&inside).await;
    listed(before);
    in_the_studio();
}

/// Checks the call over the control interface: its role, its need for command, its schema.
async fn over_http(inside: &Inside) {
    let (status, _) = ask(inside, "", "/v1/call/count_lamps", r#"{"prefix": "lamp."}"#).await;
    assert_eq!(status, 403, "it configures: without a session that commands it is refused");
    let (_, opened) = ask(inside, "", "/v1/sessions", r#"{"name": "panel"}"#).await;
    let session = opened["result"]["session"].as_str().expect("an ID");
    assert_eq!(ask(inside, session, "/v1/command", "{}").await.0, 200);
    assert_eq!(ask(inside, session, "/v1/call/count_lamps", r#"{"prefix": "lamp."}"#).await, (200, json!({ "result": 2 })));
    let schema = &control::schemas()["calls"]["count_lamps"];
    assert_eq!((&schema["role"], &schema["arguments"]["required"]), (&json!("configure"), &json!(["prefix"])));
    assert_eq!(schema["arguments"]["properties"]["prefix"]["description"], "Prefix of their names.");
    assert_eq!(schema["result"]["type"], "integer");
    assert_eq!(daemon::calls::find("count_lamps").map(|call| call.role), Some(Role::Configure));
}

/// Checks that the generators of the committed files list the call: for C, in the docs and for Python.
fn listed((header, page, python): (String, String, String)) {
    let (header_now, page_now, python_now) = (api::generate::header(api::calls()), api::generate::page(api::calls()), api::generate::python(api::calls()));
    let more = |before: &str, now: &str| now.strip_prefix(before).unwrap_or_else(|| panic!("what was there stays: {now}")).to_owned();
    assert!(more(&header, &header_now).contains("count_lamps(prefix, [most]) -> integer"));
    assert!(more(&page, &page_now).contains("Counts the SVVs of a pattern. Returns how many there are."));
    assert!(more(&python, &python_now).contains("def count_lamps(self, prefix: str, most: int | None = None) -> int:"));
}

/// Checks that the generator of the studio's types lists the call.
fn in_the_studio() {
    let maker = concat!(env!("CARGO_MANIFEST_DIR"), "/../../studio/shapes.mjs");
    let node = Command::new("node").args([maker, "--print"]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut node = match node {
        Ok(node) => node,
        Err(why) if why.kind() == std::io::ErrorKind::NotFound => return eprintln!("the types of the studio are not looked at: there is no Node here"),
        Err(why) => panic!("node cannot be started: {why}"),
    };
    let schemas = control::schemas().to_string();
    node.stdin.take().expect("a pipe").write_all(schemas.as_bytes()).expect("it reads all of it");
    let told = node.wait_with_output().expect("it ends");
    assert!(told.status.success());
    let types = String::from_utf8(told.stdout).expect("text");
    let begins = types.find("  count_lamps: {").unwrap_or_else(|| panic!("no type of the call: {types}"));
    let entry = &types[begins..begins + types[begins..].find("\n  };").expect("its end")];
    for line in ["role: \"configure\";", "/** Prefix of their names. */", "prefix: string;", "most?: number | null;", "result: number;"] {
        assert!(entry.contains(line), "{line} in: {entry}");
    }
    assert!(types.contains("/** Counts the SVVs of a pattern. Returns how many there are. */"));
}
