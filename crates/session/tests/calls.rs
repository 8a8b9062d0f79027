// SPDX-License-Identifier: Apache-2.0
//! Calls by texts: a verb's whole life, devices, values, and what is wrong with a call.
use serde_json::{Value as Json, json};
use session::{System, call, open};

const HEADER: &str = include_str!("../../c-package/include/opengpac_ps.h");

/// Every call, in the order of the header.
const CALLS: &[&str] = &[
    "processor",
    "listen",
    "take_over",
    "source",
    "request",
    "physical_device",
    "delete_physical_device",
    "place",
    "download",
    "define_verb",
    "check_graph",
    "define_device_type",
    "svv",
    "delete_svv",
    "library",
    "device",
    "enable",
    "wait_enabled",
    "disable",
    "delete_device",
    "device_state",
    "device_parameter",
    "set_device_parameter",
    "check",
    "create",
    "start",
    "wait",
    "halt",
    "suspend",
    "resume",
    "delete",
    "state",
    "instance",
    "report",
    "set",
    "read",
    "write",
    "history",
    "svv_about",
    "now",
    "advance",
    "step",
    "emergency_stop",
    "emergency_stop_input",
    "reset",
    "pause",
    "paused",
    "resume_program",
    "mode",
    "set_mode",
    "enabling_switch",
    "define_alarm",
    "raise_alarm",
    "clear_alarm",
    "alarms",
    "acknowledge_alarms",
    "restore_alarms",
    "raises",
    "exchange_verb",
    "compose",
    "verbs",
    "configuration",
    "statistics",
    "names",
    "log",
];

fn say(system: &System, name: &str, arguments: Json) -> Json {
    call(system, name, &arguments.to_string()).unwrap_or_else(|refusals| panic!("{name}: {refusals:?}"))
}

fn refused(system: &System, name: &str, arguments: &str) -> String {
    call(system, name, arguments).expect_err("refused").iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// A system with one timer, an SVV with a history, and the verb `wave`, whose amplitude is tunable.
fn system() -> System {
    let system = open("texts", "virtual", "{}").expect("it opens");
    say(&system, "processor", json!({ "name": "rtp0" }));
    say(&system, "source", json!({ "processor": "rtp0", "name": "fast", "kind": "timer", "period_ns": 1_000_000, "priority": 80 }));
    say(&system, "svv", json!({ "name": "y", "type_text": "double", "history": 10 }));
    say(
        &system,
        "define_verb",
        json!({
            "name": "wave",
            "blocks": { "wave": { "block": { "subroutine": "library.signal_generator" }, "constants": { "shape": 0 } } },
            "instantiation_parameters": { "y": ["wave.y"] },
            "input_parameters": { "level": { "targets": ["wave.offset"], "default": 1.0, "tunable": true } },
            "command_lists": { "start": { "commands": [{ "command": "activate", "block": "wave", "every_ns": 1_000_000 }] } },
        }),
    );
    system
}

fn wave(system: &System) -> Json {
    say(system, "create", json!({ "verb": "wave", "arguments": { "y": { "svv": "y" } }, "placement": { "*": "rtp0.fast" } }))
}

#[test]
fn an_instance_lives_by_texts_alone() {
    let system = system();
    let instance = wave(&system);
    let of = || json!({ "instance": instance });
    assert_eq!(say(&system, "state", of()), "created");
    say(&system, "start", json!({ "instance": instance, "values": { "level": 2.5 } }));
    say(&system, "advance", json!({ "duration_ns": 5_000_000 }));
    assert_eq!(say(&system, "read", json!({ "names": ["y"] }))["values"]["y"]["value"], 2.5);
    say(&system, "set", json!({ "instance": instance, "values": { "level": 4.0 } }));
    say(&system, "advance", json!({ "duration_ns": 5_000_000 }));
    let past = say(&system, "history", json!({ "name": "y", "count": 10 }));
    let values: Vec<f64> = past.as_array().expect("a list").iter().map(|row| row["value"].as_f64().expect("a number")).collect();
    assert_eq!((values.first(), values.last()), (Some(&2.5), Some(&4.0)));
    say(&system, "suspend", of());
    assert_eq!(say(&system, "state", of()), "suspended");
    assert_eq!(say(&system, "wait", json!({ "instance": instance, "timeout_ns": 10_000_000 })), Json::Null, "it goes on: the wait is over, not the verb");
    say(&system, "resume", of());
    assert_eq!(say(&system, "halt", of())["condition"], "halted");
    assert_eq!(say(&system, "report", of())["condition"], "halted");
    assert!(say(&system, "log", json!({})).as_array().expect("a list").iter().any(|entry| entry["kind"] == "end"));
    say(&system, "delete", of());
    say(&system, "delete_svv", json!({ "name": "y" }));
}

#[test]
fn a_device_is_made_enabled_tuned_and_stopped_by_texts_alone() {
    let system = system();
    say(
        &system,
        "define_device_type",
        json!({ "name": "lamp", "verb": "wave", "svvs": { "y": { "type_text": "double" } }, "parameters": { "level": { "default": 0.5, "tunable": true } } }),
    );
    say(&system, "device", json!({ "name": "red", "device_type": "lamp", "source": "rtp0.fast" }));
    say(&system, "enable", json!({ "name": "red" }));
    assert_eq!(say(&system, "wait_enabled", json!({ "name": "red", "timeout_ns": 1_000_000_000 })), true);
    say(&system, "set_device_parameter", json!({ "name": "red", "parameter": "level", "value": 0.75 }));
    assert_eq!(say(&system, "device_parameter", json!({ "name": "red", "parameter": "level" })), 0.75);
    say(&system, "advance", json!({ "duration_ns": 5_000_000 }));
    assert_eq!(say(&system, "read", json!({ "names": ["red.y"] }))["values"]["red.y"]["value"], 0.75);
    say(&system, "emergency_stop", json!({ "reason": "gate" }));
    assert!(refused(&system, "enable", r#"{"name": "red"}"#).contains("gate"));
    say(&system, "reset", json!({}));
    assert_eq!(say(&system, "device_state", json!({ "name": "red" })), "disabled");
    say(&system, "delete_device", json!({ "name": "red" }));
}

#[test]
fn the_header_and_the_calls_are_one_list() {
    let system = system();
    for name in CALLS {
        assert!(HEADER.contains(name), "the header lists '{name}'");
        if !matches!(*name, "place" | "step") {
            assert!(!refused(&system, name, r#"{"nonsense": 1}"#).contains("there is no call"), "'{name}' is a call");
        }
    }
}

#[test]
fn what_is_wrong_with_a_call_is_said() {
    let system = system();
    assert!(refused(&system, "sing", "").contains("there is no call 'sing'"));
    assert!(refused(&system, "advance", "{").contains("not of the right form"));
    assert!(refused(&system, "advance", r#"{"duration_ns": "long"}"#).contains("argument 'duration_ns' of call 'advance'"));
    assert!(refused(&system, "now", r#"{"zone": "UTC"}"#).contains("call 'now' has no argument 'zone'"));
    assert!(refused(&system, "source", r#"{"processor": "rtp0", "name": "x", "kind": "clock", "priority": 1}"#).contains("no kind of source 'clock'"));
    assert!(refused(&system, "create", r#"{"verb": "waves"}"#).contains("there is no verb 'waves'"));
    assert!(open("x", "sundial", "{}").is_err() && open("x", "monotonic", r#"{"interconnect": {"kind": "message"}}"#).is_err());
}

#[test]
fn a_cell_is_paused_switched_and_alarmed_by_texts_alone() {
    let system = system();
    let instance = wave(&system);
    say(&system, "start", json!({ "instance": instance }));
    say(&system, "advance", json!({ "duration_ns": 2_000_000 }));
    assert_eq!(say(&system, "pause", json!({})), json!([]), "it acts on no device");
    assert_eq!(say(&system, "state", json!({ "instance": instance })), "running");
    assert_eq!(say(&system, "resume_program", json!({})), json!([]));
    assert_eq!(say(&system, "mode", json!({})), "automatic");
    say(&system, "halt", json!({ "instance": instance }));
    say(&system, "set_mode", json!({ "mode": "manual" }));
    assert_eq!(say(&system, "mode", json!({})), "manual");
    say(&system, "define_alarm", json!({ "code": "E1", "text": "the door is open", "remedy": "close it" }));
    say(&system, "raise_alarm", json!({ "code": "E1", "source": "door" }));
    assert!(say(&system, "alarms", json!({})).to_string().contains("the door is open"));
    assert_eq!(say(&system, "clear_alarm", json!({ "code": "E1" })), true);
    assert_eq!(say(&system, "acknowledge_alarms", json!({})), 1);
    say(&system, "emergency_stop", json!({ "reason": "somebody pressed" }));
    assert!(refused(&system, "start", &json!({ "instance": instance }).to_string()).contains("somebody pressed"));
    say(&system, "reset", json!({}));
    assert!(say(&system, "verbs", json!({})).to_string().contains("wave"));
}

#[test]
fn a_call_that_lasts_answers_slice_by_slice() {
    use session::{Answered, begin};
    use std::time::Duration;
    let system = system();
    let instance = wave(&system);
    say(&system, "start", json!({ "instance": instance }));
    let slice = Duration::from_millis(1);
    let waited = begin(&system, "wait", &json!({ "instance": instance, "timeout_ns": 1_000_000_000_000_i64 }).to_string(), slice).expect("it waits");
    assert_eq!(waited, Answered::Waiting { call: "wait", arguments: json!({ "instance": instance, "until_ns": 1_000_000_000_000_i64 }) });
    let now = say(&system, "now", json!({}));
    let advanced = begin(&system, "advance", r#"{"duration_ns": 1000000000000}"#, slice).expect("it advances");
    let Answered::Waiting { call: "advance", arguments } = advanced else { panic!("{advanced:?}") };
    let passed = say(&system, "now", json!({})).as_i64().expect("ns") - now.as_i64().expect("ns");
    assert_eq!(arguments["duration_ns"].as_i64().expect("ns") + passed, 1_000_000_000_000);
    let halted = begin(&system, "halt", &json!({ "instance": instance }).to_string(), Duration::from_secs(60)).expect("it halts");
    assert!(matches!(&halted, Answered::Done(report) if report["condition"] == "halted"), "{halted:?}");
    assert!(refused(&system, "wait", r#"{"instance": 1, "timeout_ns": 1, "until_ns": 1}"#).contains("not both"));
}

#[test]
fn values_that_json_cannot_say_come_as_bytes() {
    let system = system();
    let values = say(&system, "read", json!({ "names": ["y"], "raw": true }));
    assert_eq!(values["values"]["y"]["bytes"], "AAAAAAAAAAA=");
    assert!(values["values"]["y"].get("value").is_none());
}

#[test]
fn who_comes_later_is_told_what_there_is() {
    let system = system();
    let options = json!({ "channels": [{ "name": "lamp", "direction": "write", "type": "bool" }], "table": [] });
    say(&system, "physical_device", json!({ "processor": "rtp0", "name": "io", "kind": "scripted", "options": options, "source": "rtp0.fast" }));
    let there = say(&system, "configuration", json!({}));
    assert_eq!(there["processors"]["rtp0"], json!({ "core": null, "supervisor": true }));
    assert_eq!(there["sources"]["rtp0.fast"], json!({ "processor": "rtp0", "kind": { "timer": { "period_ns": 1_000_000 } }, "priority": 80 }));
    let io = &there["physical_devices"]["io"];
    assert_eq!((io["source"].as_str(), io["channels"][0]["name"].as_str()), (Some("rtp0.fast"), Some("lamp")));
    let instance = wave(&system);
    assert_eq!(say(&system, "statistics", json!({}))["instances"][0]["id"], instance);
}
