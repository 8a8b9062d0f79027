// SPDX-License-Identifier: Apache-2.0
//! Fuzz target for the control interface over its Unix socket: requests, frames of a stream, and bytes that are neither. Each input has
//! its own system under the virtual clock, and a session that commands the system.
use crate::exchange::{Answer, Socket};
use crate::schema::misfit;
use control::{Options, Server};
use daemon::calls::{Call, find};
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use supervisor::System;

/// Runs pieces separated by empty lines, each of which is one of
/// - `METHOD PATH` and, from the next line on, a body; with a `-` before it, the request is made without the session;
/// - `ws` and, from the next line on, one stream frame per line;
/// - `raw` and, from the next line on, bytes that are sent unchanged.
///
/// Checks that every request gets an answer that matches its schema, and that nothing panics.
pub(crate) fn control(bytes: &[u8]) {
    let rig = Rig::new();
    for piece in pieces(bytes) {
        let (head, rest) = split(piece, b"\n");
        match head {
            b"raw" => rig.socket().raw(rest),
            b"ws" => rig.socket().stream(rest).iter().for_each(judge_frame),
            _ => rig.request(head, rest),
        }
    }
}

/// System behind the socket, with its session.
struct Rig {
    /// Server, which is stopped before the folder is removed.
    server: Option<Server>,
    folder: PathBuf,
    session: String,
}

impl Rig {
    fn new() -> Rig {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let folder = std::env::temp_dir().join(format!("fuzz-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
        std::fs::create_dir_all(&folder).expect("a folder can be made");
        let options = Options { socket: Some(folder.join("s")), python: Some("/bin/false".to_owned()), ..Options::default() };
        let server = Server::start(system(), &options).expect("a socket of its own");
        let mut rig = Rig { server: Some(server), folder, session: String::new() };
        let opened = rig.socket().request("POST", "/v1/sessions", None, br#"{"name": "fuzzer"}"#);
        rig.session = opened.body["result"]["session"].as_str().expect("the first session is let in").to_owned();
        assert_eq!(rig.socket().request("POST", "/v1/command", Some(&rig.session), b"{}").status, 200);
        rig
    }

    fn socket(&self) -> Socket {
        Socket(self.folder.join("s"))
    }

    /// Makes one request and checks that its answer matches its schema.
    fn request(&self, head: &[u8], body: &[u8]) {
        let Some((is_ours, method, path)) = std::str::from_utf8(head).ok().and_then(understood) else { return };
        let call = path.strip_prefix("/v1/call/").and_then(find);
        let body = if call.is_some_and(|call: &Call| call.lasts) { shortened(body) } else { body.to_vec() };
        let session = is_ours.then_some(self.session.as_str());
        let answer = self.socket().request(method, path, session, &body);
        if method != "HEAD" {
            judge(path, call, &answer);
        }
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        drop(self.server.take());
        let _gone = std::fs::remove_dir_all(&self.folder);
    }
}

/// Creates a system with one timer, the SVV `y`, a drive, and the verb `wave`, which runs until it is ended.
fn system() -> Arc<System> {
    let system = api::open("cell", "virtual", "{}").expect("a system of its own");
    let say = |name: &str, arguments: Json| api::call(&system, name, &arguments.to_string()).expect("what it has is well formed");
    say("processor", json!({ "name": "rtp0" }));
    say("source", json!({ "processor": "rtp0", "name": "fast", "kind": "timer", "period_ns": 1_000_000, "priority": 80 }));
    say("svv", json!({ "name": "y", "type_text": "double", "history": 10 }));
    let drive = json!({ "processor": "rtp0", "name": "drive", "kind": "loopback", "options": { "parts": ["x"] }, "source": "rtp0.fast" });
    say("physical_device", drive);
    let wave = json!({
        "name": "wave",
        "blocks": { "wave": { "block": { "subroutine": "library.signal_generator" }, "constants": { "shape": 0, "offset": 2.5 } } },
        "instantiation_parameters": { "y": ["wave.y"] },
        "command_lists": { "start": { "commands": [{ "command": "activate", "block": "wave", "every_ns": 1_000_000 }] } },
    });
    say("define_verb", wave);
    Arc::new(system)
}

/// Parses the head of a request. Returns true if the session makes the request, then the method and the path. Returns `None` for bytes
/// that HTTP cannot carry (`raw` sends these), for held requests, which are answered only at the end of their session, and for modules,
/// whose compilation is not fuzzed here.
fn understood(head: &str) -> Option<(bool, &str, &str)> {
    let (is_ours, head) = head.strip_prefix('-').map_or((true, head), |head| (false, head));
    let (method, path) = head.split_once(' ')?;
    let is_method = ["GET", "POST", "PUT", "DELETE", "PATCH", "HEAD"].contains(&method);
    let is_path = path.starts_with("/v1/") && path.bytes().all(|byte| byte.is_ascii_graphic() && !b"\"#<>\\^`{|}".contains(&byte));
    let is_apart = path.starts_with("/v1/hold") || path.starts_with("/v1/modules");
    (is_method && is_path && !is_apart).then_some((is_ours, method, path))
}

/// Shortens long-running requests to one millisecond, unless the input sets a time.
fn shortened(body: &[u8]) -> Vec<u8> {
    match serde_json::from_slice(body) {
        Ok(Json::Object(mut arguments)) => {
            arguments.entry("slice_ms").or_insert(json!(1));
            Json::Object(arguments).to_string().into_bytes()
        }
        _ => body.to_vec(),
    }
}

fn judge(path: &str, call: Option<&Call>, answer: &Answer) {
    let (status, body) = (answer.status, &answer.body);
    match status {
        200 if ["/v1/version", "/v1/schema", "/v1/openapi.json"].iter().any(|whole| path.split('?').next() == Some(whole)) => {
            assert!(body.is_object(), "{path}: {body}")
        }
        200 if body["waiting"] == true => {
            let is_whole = body["now_ns"].is_i64() && body["go_on"]["call"].is_string() && body["go_on"]["arguments"].is_object();
            assert!(is_whole && call.is_some_and(|call: &Call| call.lasts), "{path}: {body}");
        }
        200 => {
            let result = body.get("result").unwrap_or_else(|| panic!("{path}: {body}"));
            let schema = call.map_or(&Json::Bool(true), |call| &schemas()["calls"][call.name]["result"]);
            assert_eq!(misfit(schema, result, schemas()), None, "{path}: {body}");
        }
        400..=499 | 503 => judge_errors(path, body),
        _ => panic!("{path} is answered with {status}: {body}"),
    }
}

fn judge_errors(path: &str, body: &Json) {
    assert_eq!(misfit(&schemas()["requests"]["errors"], body, schemas()), None, "{path}: {body}");
    let errors = body["errors"].as_array().expect("the schema says so");
    assert!(!errors.is_empty() && errors.iter().all(|error| error["message"].as_str().is_some_and(|text| !text.is_empty())), "{path}: {body}");
}

/// Checks a frame sent by the server: a notification of a subscription, or errors.
fn judge_frame(frame: &Json) {
    if frame.get("errors").is_some() {
        return judge_errors("stream", frame);
    }
    let has_id = frame["id"].is_string() && frame["dropped"].is_u64();
    let topics = ["svvs", "log", "ends"].iter().filter(|topic| frame.get(**topic).is_some()).count();
    assert!(has_id && topics == 1, "{frame}");
    for (topic, call) in [("svvs", "read"), ("log", "log")] {
        if let Some(told) = frame.get(topic) {
            assert_eq!(misfit(&schemas()["calls"][call]["result"], told, schemas()), None, "{frame}");
        }
    }
}

fn schemas() -> &'static Json {
    static SCHEMAS: OnceLock<Json> = OnceLock::new();
    SCHEMAS.get_or_init(control::schemas)
}

fn pieces(mut bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let (piece, rest) = (!bytes.is_empty()).then(|| split(bytes, b"\n\n"))?;
        bytes = rest;
        Some(piece)
    })
}

/// Returns the bytes before the first occurrence of `at` and the bytes after it; if it does not occur, all bytes and an empty slice.
fn split<'a>(bytes: &'a [u8], at: &[u8]) -> (&'a [u8], &'a [u8]) {
    let place = bytes.windows(at.len()).position(|window| window == at);
    place.map_or((bytes, &[]), |place| (&bytes[..place], &bytes[place + at.len()..]))
}
