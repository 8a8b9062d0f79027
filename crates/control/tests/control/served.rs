// SPDX-License-Identifier: Apache-2.0
//! A served system: sessions, command, calls, waits, and a programming system that disconnects.
use crate::rig::{Rig, class, receive, send, wave};
use crate::stream::{next, open};
use serde_json::{Value as Json, json};
use std::os::unix::net::UnixStream;

#[test]
fn a_verb_lives_by_requests_alone() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let id = rig.running(&session, "wave");
    rig.call(&session, "advance", json!({ "duration_ns": 5_000_000 }));
    assert_eq!(rig.call(&session, "read", json!({ "names": ["y"] }))["values"]["y"]["value"], 2.5);
    let wait = json!({ "instance": id, "timeout_ns": 1_000_000_000_000_000_i64, "slice_ms": 1 });
    let (status, waiting) = rig.ask("POST", "/v1/call/wait", &[("opengpac-session", &session)], &wait.to_string());
    assert_eq!((status, &waiting["waiting"], &waiting["go_on"]["call"]), (200, &json!(true), &json!("wait")));
    let mut arguments = waiting["go_on"]["arguments"].clone();
    assert_eq!(arguments["instance"], id);
    arguments["slice_ms"] = json!(1);
    let (_, again) = rig.ask("POST", "/v1/call/wait", &[("opengpac-session", &session)], &arguments.to_string());
    assert_eq!(again["go_on"], waiting["go_on"], "the timeout is not begun anew");
    assert_eq!(rig.call(&session, "halt", json!({ "instance": id }))["condition"], "halted");
    rig.call(&session, "delete", json!({ "instance": id }));
    let (_, listed) = rig.ask("GET", "/v1/sessions", &[], "");
    assert_eq!((&listed["result"][0]["name"], &listed["result"][0]["commands"]), (&json!("panel"), &json!(true)));
}

#[test]
fn one_commands_and_all_may_look_and_stop() {
    let rig = Rig::new();
    let (first, second) = (rig.commander("first"), rig.open("second"));
    fn of(session: &str) -> [(&str, &str); 1] {
        [("opengpac-session", session)]
    }
    let (status, answer) = rig.ask("POST", "/v1/command", &of(&second), "{}");
    assert_eq!((status, class(&answer)), (403, "NotCommanding"));
    assert!(answer["errors"][0]["message"].as_str().is_some_and(|m| m.contains("'first'")), "{answer}");
    let start = json!({ "name": "x", "type_text": "double" }).to_string();
    assert_eq!(class(&rig.ask("POST", "/v1/call/svv", &of(&second), &start).1), "NotCommanding");
    assert_eq!(class(&rig.ask("POST", "/v1/call/svv", &[], &start).1), "NotCommanding");
    assert_eq!(rig.call(&second, "mode", json!({})), "automatic");
    rig.call(&second, "emergency_stop", json!({ "reason": "somebody saw something" }));
    assert_eq!(class(&rig.ask("POST", "/v1/call/reset", &of(&second), "").1), "NotCommanding");
    // Two sessions of the same run of a system see the same ID.
    let run = |session: &str| rig.ask("GET", "/v1/version", &of(session), "").1["run"].clone();
    assert!(run(&first).is_string() && run(&first) == run(&second));
    rig.call(&first, "reset", json!({}));
    let instance = rig.running(&first, "wave");
    let (status, answer) = rig.ask("POST", "/v1/command", &of(&second), r#"{"force": true}"#);
    assert_eq!((status, &answer["result"]["holder"]), (200, &json!("second")));
    assert_eq!(class(&rig.ask("POST", "/v1/call/svv", &of(&first), &start).1), "NotCommanding");
    // A session that has lost command can still stop what it has started, and so can everyone who may operate.
    rig.call(&first, "suspend", json!({ "instance": instance }));
    assert_eq!(class(&rig.ask("POST", "/v1/call/resume", &of(&first), &json!({ "instance": instance }).to_string()).1), "NotCommanding");
    assert_eq!(rig.call(&first, "halt", json!({ "instance": instance }))["condition"], "halted");
    rig.call(&first, "pause", json!({}));
    rig.ask("DELETE", "/v1/command", &of(&second), "");
    assert_eq!(rig.ask("GET", "/v1/command", &[], "").1["result"]["holder"], Json::Null);
}

/// Holds a session open with a connection.
fn hold(rig: &Rig, name: &str, session: &str) -> UnixStream {
    let mut stream = rig.connect();
    send(&mut stream, "GET", "/v1/hold", &[("opengpac-session", session)], b"");
    let is_held = |rig: &Rig| {
        let (_, listed) = rig.ask("GET", "/v1/sessions", &[], "");
        listed["result"].as_array().expect("a list").iter().any(|s| s["name"] == name && s["held"] == true)
    };
    rig.until(is_held);
    stream
}

fn is_lost(rig: &Rig, name: &str) -> bool {
    let (_, listed) = rig.ask("GET", "/v1/sessions", &[], "");
    listed["result"].as_array().expect("a list").iter().any(|s| s["name"] == name && s["alive"] == false)
}

#[test]
fn what_runs_follows_its_policy_when_its_programming_system_is_gone() {
    let rig = Rig::with("monotonic", |_, _| {});
    for (verb, policy) in [("goes_on", "continue"), ("stops", "safe")] {
        api::call(&rig.system, "define_verb", &wave(verb, json!(policy)).to_string()).unwrap_or_else(|r| panic!("{r:?}"));
    }
    api::call(&rig.system, "svv", r#"{"name": "z", "type_text": "double"}"#).unwrap_or_else(|r| panic!("{r:?}"));
    let session = rig.commander("panel");
    let create = |verb: &str, svv: &str| {
        let id = rig.call(&session, "create", json!({ "verb": verb, "arguments": { "y": { "svv": svv } }, "placement": { "*": "rtp0.fast" } }));
        rig.call(&session, "start", json!({ "instance": id }));
        id
    };
    let (halted, going) = (create("wave", "y"), create("goes_on", "z"));
    drop(hold(&rig, "panel", &session));
    rig.until(|rig| is_lost(rig, "panel"));
    assert_eq!(rig.ask("GET", "/v1/command", &[], "").1["result"]["holder"], Json::Null);
    assert_eq!(class(&rig.ask("POST", "/v1/heartbeat", &[("opengpac-session", &session)], "").1), "SessionLost");
    let reports = |rig: &Rig| rig.ask("GET", "/v1/sessions/panel/reports", &[], "").1["result"].clone();
    rig.until(|rig| reports(rig)["reports"].as_array().is_some_and(|r| r.len() == 1));
    let kept = &reports(&rig)["reports"][0];
    assert_eq!((&kept["instance"], &kept["report"]["condition"]), (&halted, &json!("halted")));
    assert!(kept["report"]["message"].as_str().is_some_and(|m| m.contains("'panel' was cut off")), "{kept}");
    // The instance has ended and no client could ask for it: it is deleted, but its report is kept.
    rig.until(|rig| rig.system.state(halted.as_u64().expect("a number")) == "deleted");
    let (_, back) = rig.ask("POST", "/v1/sessions", &[], r#"{"name": "panel"}"#);
    let back = &back["result"];
    assert_eq!((&back["returned"], &back["kept_reports"]), (&json!(true), &json!(1)));
    assert_eq!(back["instances"], json!([{ "instance": going, "name": "goes_on#1", "state": "running" }]), "{back}");
    let number = kept["number"].as_u64().expect("a number");
    assert_eq!(rig.ask("DELETE", &format!("/v1/sessions/panel/reports?through={number}"), &[], "").0, 200);
    assert_eq!(reports(&rig)["reports"], json!([]));
    assert!(rig.audit().iter().any(|line| line["call"] == "cut_off" && line["session"] == "panel"));
}

/// Creates an instance of `wave` on behalf of the program, not started.
fn of_the_program(rig: &Rig) -> u64 {
    let made = json!({ "verb": "wave", "arguments": { "y": { "svv": "y" } }, "placement": { "*": "rtp0.fast" } });
    let made = api::call(&rig.system, "create", &made.to_string()).unwrap_or_else(|r| panic!("{r:?}"));
    made.as_u64().expect("a number")
}

#[test]
fn an_instance_of_the_program_outlives_the_session_that_started_it() {
    let rig = Rig::new();
    let instance = of_the_program(&rig);
    let panel = rig.commander("panel");
    let held = hold(&rig, "panel", &panel);
    rig.call(&panel, "start", json!({ "instance": instance }));
    drop(held);
    rig.until(|rig| is_lost(rig, "panel") && rig.system.state(instance) == "ended");
    // Opening a session first handles the lost ones.
    let next = rig.commander("next");
    assert_eq!(rig.system.state(instance), "ended", "it was halted, and it is there");
    rig.call(&next, "start", json!({ "instance": instance }));
    assert_eq!(rig.system.state(instance), "running");
}

#[test]
fn a_start_that_is_refused_takes_no_instance_from_who_runs_it() {
    let rig = Rig::new();
    let first = rig.commander("first");
    let instance = rig.running(&first, "wave");
    let second = rig.open("second");
    let held = hold(&rig, "second", &second);
    rig.ask("POST", "/v1/command", &[("opengpac-session", &second)], r#"{"force": true}"#);
    let (status, answer) = rig.ask("POST", "/v1/call/start", &[("opengpac-session", &second)], &json!({ "instance": instance }).to_string());
    assert!(status >= 400, "{answer}");
    drop(held);
    rig.until(|rig| is_lost(rig, "second"));
    rig.open("third");
    assert_eq!(rig.system.state(instance), "running", "the session that runs it is there");
}

#[test]
fn a_command_that_was_held_up_is_refused_and_a_stop_is_taken() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let instance = of_the_program(&rig);
    let mut stream = open(&rig, "/v1/stream?beat=true", None);
    let now_ms = next(&mut stream)["beat"].as_u64().expect("the time");
    let asked = |call: &str, then_ms: u64| {
        let headers = [("opengpac-session", session.as_str()), ("opengpac-as-of", &then_ms.to_string())];
        rig.ask("POST", &format!("/v1/call/{call}"), &headers, &json!({ "instance": instance }).to_string())
    };
    let (status, answer) = asked("start", now_ms - 4_300);
    assert_eq!((status, class(&answer)), (409, "InvalidState"), "{answer}");
    assert!(answer["errors"][0]["message"].as_str().is_some_and(|said| said.contains("within 500 ms")), "{answer}");
    assert_eq!(rig.system.state(instance), "created");
    assert_eq!(asked("start", now_ms - 4_300_000_000).0, 409, "of an earlier run");
    assert_eq!(asked("start", now_ms + 60_000).0, 409, "of another run");
    let late = [("opengpac-session", session.as_str()), ("opengpac-as-of", "0")];
    let (status, answer) = rig.ask("POST", "/v1/call/acknowledge_alarms", &late, "{}");
    assert_eq!(status, 200, "it moves nothing, so it may be late: {answer}");
    rig.call(&session, "start", json!({ "instance": instance }));
    assert_eq!(asked("state", 0).1["result"], "running", "to look is no command");
    let (status, answer) = asked("halt", 0);
    assert_eq!(status, 200, "{answer}");
    let said = rig.ask("POST", "/v1/call/start", &[("opengpac-session", &session), ("opengpac-as-of", "soon")], "{}").1;
    assert_eq!(class(&said), "CallError");
}

#[test]
fn a_stream_with_a_heartbeat_goes_on_telling_the_time() {
    let rig = Rig::new();
    let mut stream = open(&rig, "/v1/stream?beat=true", None);
    let beats: Vec<u64> = (0..3).map(|_| next(&mut stream)["beat"].as_u64().expect("the time")).collect();
    assert!(beats.is_sorted() && beats[2] > beats[0], "{beats:?}");
}

#[test]
fn a_session_that_is_closed_in_order_cuts_nothing_off() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let id = rig.running(&session, "wave");
    let mut held = hold(&rig, "panel", &session);
    assert_eq!(rig.ask("DELETE", "/v1/sessions", &[("opengpac-session", &session)], "").0, 200);
    assert_eq!(receive(&mut held).0, 200, "who holds it is told");
    rig.system.advance(5_000_000).unwrap_or_else(|r| panic!("{r:?}"));
    assert_eq!(rig.system.state(id), "running");
    assert_eq!(rig.ask("GET", "/v1/sessions", &[], "").1["result"], json!([]));
}

#[test]
fn what_has_been_told_is_not_kept() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let id = rig.running(&session, "wave");
    rig.call(&session, "halt", json!({ "instance": id }));
    let kept = || rig.ask("GET", "/v1/sessions/panel/reports", &[], "").1["result"]["reports"].as_array().map(Vec::len);
    assert_eq!(kept(), Some(1), "the answer may not have arrived");
    rig.ask("POST", "/v1/heartbeat", &[("opengpac-session", &session)], "");
    assert_eq!(kept(), Some(0));
}

#[test]
fn requests_that_make_no_sense_are_refused_in_words() {
    let rig = Rig::new();
    let ask = |method: &str, path: &str, body: &str| {
        let (status, answer) = rig.ask(method, path, &[], body);
        (status, class(&answer).to_owned())
    };
    let expect = |status: u16, class: &str| (status, class.to_owned());
    assert_eq!(ask("POST", "/v1/call/sing", "{}"), expect(404, "UnknownName"));
    assert_eq!(ask("POST", "/v1/call/download", r#"{"path": "/etc/passwd"}"#), expect(404, "UnknownName"));
    assert_eq!(ask("GET", "/v2/version", ""), expect(404, "UnknownName"));
    assert_eq!(ask("DELETE", "/v1/version", ""), expect(405, "CallError"));
    assert_eq!(ask("POST", "/v1/call/now", "{"), expect(400, "CallError"));
    assert_eq!(ask("POST", "/v1/call/now", "[]"), expect(400, "CallError"));
    assert_eq!(ask("POST", "/v1/call/now", r#"{"slice_ms": 5}"#), expect(400, "CallError"));
    assert_eq!(ask("POST", "/v1/heartbeat", ""), expect(400, "CallError"));
    assert_eq!(ask("POST", "/v1/sessions", r#"{"name": "a b"}"#), expect(400, "CallError"));
    assert_eq!(ask("DELETE", "/v1/sessions/x/reports", ""), expect(400, "CallError"));
    assert_eq!(ask("GET", "/v1/stream", ""), expect(400, "CallError"));
    assert_eq!(ask("POST", "/v1/call/now", &" ".repeat((64 << 10) + 1)), expect(413, "LimitExceeded"));
    let (status, answer) = rig.ask("GET", "/v1/version", &[("host", "evil.example")], "");
    assert_eq!((status, class(&answer)), (403, "NotAllowed"));
    let (status, answer) = rig.ask("POST", "/v1/heartbeat", &[("opengpac-session", "nonsense")], "");
    assert_eq!((status, class(&answer)), (410, "SessionLost"));
}
