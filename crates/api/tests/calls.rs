// SPDX-License-Identifier: Apache-2.0
//! Calls from text: the full life of a verb, devices, values, and the errors of malformed calls.
use api::{System, call, open};
use serde_json::{Value as Json, json};

const HEADER: &str = include_str!("../../c-package/include/opengpac_ps.h");

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
fn a_call_of_a_verb_is_one_call() {
    let system = system();
    let asked = json!({
        "verb": "wave", "arguments": { "y": { "svv": "y" } }, "placement": { "*": "rtp0.fast" }, "values": { "level": 2.5 },
        "limits": { "time_limit_ns": 5_000_000 },
    });
    for number in 1..=3 {
        let report = say(&system, "perform", asked.clone());
        assert_eq!((&report["condition"], &report["instance"]), (&json!("time_limit"), &json!(format!("wave#{number}"))));
        assert_eq!(say(&system, "read", json!({ "names": ["y"] }))["values"]["y"]["value"], 2.5);
        assert_eq!(say(&system, "names", json!({}))["instances"], json!([]), "nothing is left");
    }
    say(&system, "delete_svv", json!({ "name": "y" }));
    assert!(refused(&system, "perform", &asked.to_string()).contains("'y'"), "what it stood on is gone");
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
    for name in api::calls().map(|call| call.name) {
        assert!(HEADER.contains(name), "the header lists '{name}'");
        if !matches!(name, "place" | "step") {
            assert!(!refused(&system, name, r#"{"nonsense": 1}"#).contains("there is no call"), "'{name}' is a call");
        }
    }
}

#[test]
fn what_is_wrong_with_a_call_is_said() {
    let system = system();
    assert!(refused(&system, "sing", "").contains("there is no call 'sing'"));
    assert!(refused(&system, "advance", "{").contains("does not have the right form"));
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
    use api::{CallResult, begin};
    use std::time::Duration;
    let system = system();
    let instance = wave(&system);
    say(&system, "start", json!({ "instance": instance }));
    let slice = Duration::from_millis(1);
    let waited = begin(&system, "wait", &json!({ "instance": instance, "timeout_ns": 1_000_000_000_000_i64 }).to_string(), slice).expect("it waits");
    assert_eq!(waited, CallResult::Waiting { call: "wait", arguments: json!({ "instance": instance, "until_ns": 1_000_000_000_000_i64 }) });
    let now = say(&system, "now", json!({}));
    let advanced = begin(&system, "advance", r#"{"duration_ns": 1000000000000}"#, slice).expect("it advances");
    let CallResult::Waiting { call: "advance", arguments } = advanced else { panic!("{advanced:?}") };
    let passed = say(&system, "now", json!({})).as_i64().expect("ns") - now.as_i64().expect("ns");
    assert_eq!(arguments["duration_ns"].as_i64().expect("ns") + passed, 1_000_000_000_000);
    let halted = begin(&system, "halt", &json!({ "instance": instance }).to_string(), Duration::from_secs(60)).expect("it halts");
    assert!(matches!(&halted, CallResult::Done(report) if report["condition"] == "halted"), "{halted:?}");
    assert!(refused(&system, "wait", r#"{"instance": 1, "timeout_ns": 1, "until_ns": 1}"#).contains("cannot have both"));
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
    assert_eq!(there["processors"]["rtp0"], json!({ "core": null, "supervisor": true, "process": null, "host": null }));
    assert_eq!(there["sources"]["rtp0.fast"], json!({ "processor": "rtp0", "kind": { "timer": { "period_ns": 1_000_000 } }, "priority": 80 }));
    let io = &there["physical_devices"]["io"];
    assert_eq!((io["source"].as_str(), io["channels"][0]["name"].as_str()), (Some("rtp0.fast"), Some("lamp")));
    let instance = wave(&system);
    assert_eq!(say(&system, "statistics", json!({}))["instances"][0]["id"], instance);
}

#[test]
fn a_processor_says_its_process_by_a_word_or_by_its_name() {
    let system = system();
    for (name, process) in [("own", json!(true)), ("here", json!(false)), ("left", json!("cell-a")), ("right", json!("cell-a"))] {
        say(&system, "processor", json!({ "name": name, "process": process }));
    }
    let processes = json!({ "own": ["own"], "cell-a": ["left", "right"] });
    assert_eq!(say(&system, "statistics", json!({}))["processes"], processes);
    assert_eq!(say(&system, "names", json!({}))["processes"], processes);
    let shown = say(&system, "configuration", json!({}));
    assert_eq!((&shown["processors"]["right"]["process"], &shown["processors"]["here"]["process"]), (&json!("cell-a"), &Json::Null));
    for (process, host, why) in
        [("\"\"", "null", "which is not a valid name"), ("\"a\"", "\"cell-b\"", "on host 'cell-b'"), ("\"own\"", "null", "'own' has its own process")]
    {
        let text = refused(&system, "processor", &format!(r#"{{"name": "more", "process": {process}, "host": {host}}}"#));
        assert!(text.contains(why), "{text}");
    }
    assert!(refused(&system, "processor", r#"{"name": "more", "process": 4}"#).contains("argument 'process'"));
}

#[test]
fn what_is_installed_is_drawn_out() {
    let system = system();
    assert_eq!(say(&system, "installed", json!({})), json!({ "instances": [] }));
    let id = wave(&system);
    say(&system, "start", json!({ "instance": id, "values": { "level": 2.5 } }));
    let drawn = say(&system, "installed", json!({}));
    let wave = &drawn["instances"][0];
    assert_eq!(
        (&wave["name"], &wave["verb"], &wave["state"], &wave["list"], &wave["initial"]),
        (&json!("wave#1"), &json!("wave"), &json!("running"), &json!("start"), &json!("start"))
    );
    assert_eq!((&wave["starts"], &wave["owner"], &wave["device"], &wave["ending"]), (&json!(1), &Json::Null, &Json::Null, &Json::Null));
    assert_eq!(wave["lists"], json!([{ "name": "start", "commands": ["activate wave every 1 ms"] }]));
    let block = &wave["blocks"][0];
    assert_eq!((&block["label"], &block["block"], &block["source"]), (&json!("wave"), &json!("library.signal_generator"), &json!("rtp0.fast")));
    assert_eq!((&block["every_ns"], &block["activation"]["on"], &block["activation"]["due"]), (&json!(1_000_000), &json!(true), &json!("interval")));
    let port = |name: &str| block["ports"].as_array().expect("ports").iter().find(|port| port["name"] == name).cloned().unwrap_or_default();
    assert_eq!((&port("y")["direction"], &port("y")["type_text"], &port("y")["cell"]), (&json!("output"), &json!("double"), &json!("y")));
    assert_eq!((&port("shape")["value"], &port("shape")["cell"]), (&json!(0), &Json::Null));
    assert_eq!(wave["cells"], json!([{ "name": "y", "kind": "svv", "type_text": "double", "unit": "", "writers": [["wave", "y"]], "readers": [] }]));
    let halted = wave["conditions"].as_array().expect("conditions").iter().find(|c| c["name"] == "halted").expect("it has the system's");
    assert_eq!((&halted["system"], &halted["of"]), (&json!(true), &json!([])));
    say(&system, "halt", json!({ "instance": id }));
    let ended = say(&system, "installed", json!({}));
    assert_eq!((&ended["instances"][0]["state"], &ended["instances"][0]["blocks"][0]["activation"]["on"]), (&json!("ended"), &json!(false)));
}

#[test]
fn private_cells_and_channels_are_read_by_their_names() {
    let system = system();
    let options =
        json!({ "channels": [{ "name": "level", "type": "double", "unit": "m", "direction": "read" }], "table": [{ "at_ns": 0, "values": { "level": 1.5 } }] });
    say(&system, "physical_device", json!({ "processor": "rtp0", "name": "io", "kind": "scripted", "options": options, "source": "rtp0.fast" }));
    let mut verb = json!({
        "name": "inner", "cells": { "t": ["wave.y"] },
        "blocks": { "wave": { "block": { "subroutine": "library.signal_generator" }, "constants": { "shape": 0, "offset": 4.5 } } },
        "command_lists": { "start": { "commands": [{ "command": "activate", "block": "wave", "every_ns": 1_000_000 }] } },
    });
    say(&system, "define_verb", verb.take());
    let id = say(&system, "create", json!({ "verb": "inner", "placement": { "*": "rtp0.fast" } }));
    say(&system, "start", json!({ "instance": id }));
    say(&system, "advance", json!({ "duration_ns": 3_000_000 }));
    let before = say(&system, "now", json!({}));
    let values = say(&system, "read", json!({ "names": ["inner#1:t", "io.level", "y"] }));
    assert_eq!(values["values"]["inner#1:t"], json!({ "value": 4.5, "number": 2, "time_ns": 3_000_000 }));
    assert_eq!(values["values"]["io.level"]["value"], 1.5);
    assert_eq!(say(&system, "now", json!({})), before, "looking takes no time");
    let about = say(&system, "svv_about", json!({ "name": "inner#1:t" }));
    assert_eq!((&about["kind"], &about["type_text"], &about["writers"]), (&json!("private"), &json!("double"), &json!(["inner#1.wave.y"])));
    let about = say(&system, "svv_about", json!({ "name": "io.level" }));
    assert_eq!((&about["kind"], &about["unit"]), (&json!("channel"), &json!("m")));
    assert_eq!(say(&system, "svv_about", json!({ "name": "y" }))["kind"], "svv");
    for wrong in ["inner#1:u", "inner#2:t", "io.depth", "io"] {
        assert!(refused(&system, "svv_about", &json!({ "name": wrong }).to_string()).contains(wrong), "{wrong}");
        assert!(refused(&system, "read", &json!({ "names": [wrong] }).to_string()).contains(wrong), "{wrong}");
    }
}

#[test]
fn a_form_asks_for_what_a_start_needs() {
    let system = system();
    say(
        &system,
        "define_device_type",
        json!({ "name": "Joint", "svvs": { "commanded": { "type_text": "double", "unit": "rad" } }, "parameters": { "max_speed": { "default": 2.0 } } }),
    );
    say(
        &system,
        "define_verb",
        json!({
            "name": "turn", "doc": "Turns.", "objects": { "arm": { "device_type": "Joint" } },
            "blocks": { "wave": { "block": { "subroutine": "library.signal_generator" } } },
            "instantiation_parameters": { "arm.commanded": ["wave.y"] },
            "input_parameters": {
                "speed": { "targets": ["wave.amplitude"], "unit": "rad", "within": ["-arm.max_speed", 3.0] },
                "level": { "targets": ["wave.offset"], "default": 1.0, "tunable": true },
            },
            "modes": {},
            "command_lists": { "start": { "commands": [{ "command": "activate", "block": "wave", "every_ns": 1_000_000 }] } },
        }),
    );
    let form = say(&system, "verb_form", json!({ "name": "turn" }));
    assert_eq!((&form["name"], &form["doc"], &form["defined"]["name"]), (&json!("turn"), &json!("Turns."), &json!("turn")));
    assert_eq!(form["arguments"].as_array().map(Vec::len), Some(1));
    assert_eq!((&form["arguments"][0]["name"], &form["arguments"][0]["kind"], &form["arguments"][0]["of"]), (&json!("arm"), &json!("device"), &json!("Joint")));
    let speed = &form["inputs"][0];
    assert_eq!((&speed["name"], &speed["type_text"], &speed["unit"]), (&json!("speed"), &json!("double"), &json!("rad")));
    assert_eq!((&speed["minimum"], &speed["maximum"], &speed["required"]), (&json!("-arm.max_speed"), &json!(3.0), &json!(true)));
    let level = &form["inputs"][1];
    assert_eq!((&level["default"], &level["required"], &level["tunable"], &level["minimum"]), (&json!(1.0), &json!(false), &json!(true), &Json::Null));
    let own = say(&system, "verb_form", json!({ "name": "wave" }));
    assert_eq!((&own["arguments"][0]["name"], &own["arguments"][0]["kind"], &own["arguments"][0]["type_text"]), (&json!("y"), &json!("svv"), &json!("double")));
    assert!(refused(&system, "verb_form", r#"{"name": "waves"}"#).contains("there is no verb 'waves'"));
}

#[test]
fn only_a_machine_with_a_shape_is_drawn() {
    let system = system();
    let options = json!({ "parts": ["x"] });
    say(&system, "physical_device", json!({ "processor": "rtp0", "name": "drives", "kind": "loopback", "options": options, "source": "rtp0.fast" }));
    assert!(refused(&system, "geometry", r#"{"device": "drives"}"#).contains("has no geometry: its driver 'loopback' provides none"));
    assert!(refused(&system, "geometry", r#"{"device": "arm"}"#).contains("there is no physical device 'arm'"));
}

#[test]
fn a_source_says_where_it_is_and_the_log_who_commanded() {
    let system = system();
    let fast = say(&system, "statistics", json!({}))["sources"]["rtp0.fast"].clone();
    assert_eq!((&fast["processor"], &fast["kind"], &fast["period_ns"], &fast["priority"]), (&json!("rtp0"), &json!("timer"), &json!(1_000_000), &json!(80)));
    assert_eq!((&fast["core"], &fast["rights_asked"], &fast["rights_missing"]), (&Json::Null, &json!([]), &json!([])));
    let arguments = json!({ "instance": wave(&system) });
    let about = api::commanded(&system, "start", arguments.as_object().expect("arguments"));
    assert_eq!(about.as_deref(), Some("wave#1"));
    for looks in ["read", "wait", "advance", "step", "statistics"] {
        assert_eq!(api::commanded(&system, looks, arguments.as_object().expect("arguments")), None, "{looks}");
    }
    system.log_command("panel", "start", "wave#1", None);
    system.log_command("panel", "halt", "wave#1", Some("it does not run"));
    let instance = arguments["instance"].as_u64().expect("a number");
    let command = |call| supervisor::ProgramCommand { call, subject: supervisor::CommandSubject::Instance(instance), stops: false };
    assert!(system.as_program(&command("resume"), || system.resume(instance)).is_err());
    system.as_program(&command("start"), || system.start(instance, &indexmap::IndexMap::new(), Default::default())).expect("starts");
    let log = say(&system, "log", json!({}));
    let told: Vec<_> = log.as_array().expect("a list").iter().filter(|e| e["kind"] == "command").map(|e| json!([e["who"], e["text"], e["about"]])).collect();
    let expected = [
        json!(["panel", "start", "wave#1"]),
        json!(["panel", "halt was refused: it does not run", "wave#1"]),
        json!(["program", "resume was refused: cannot resume 'wave#1': it is created", "wave#1"]),
        json!(["program", "start", "wave#1"]),
    ];
    assert_eq!(told, expected);
}

#[test]
fn block_times_are_taken_while_somebody_looks() {
    let system = system();
    let instance = wave(&system);
    say(&system, "start", json!({ "instance": instance }));
    say(&system, "advance", json!({ "duration_ns": 5_000_000 }));
    let source = &say(&system, "statistics", json!({}))["sources"]["rtp0.fast"];
    assert_eq!((&source["probed"], &source["blocks"]), (&json!(false), &json!([])));
    say(&system, "probe", json!({ "source": "rtp0.fast", "for_ns": 600_000_000_000_u64 }));
    say(&system, "advance", json!({ "duration_ns": 5_000_000 }));
    let source = &say(&system, "statistics", json!({}))["sources"]["rtp0.fast"];
    let block = &source["blocks"][0];
    assert_eq!(
        (&source["probed"], &block["label"], &block["block"], &block["samples"]),
        (&json!(true), &json!("wave"), &json!("library.signal_generator"), &json!(5))
    );
    assert!(block["max_ns"].as_u64() >= block["last_ns"].as_u64());
    assert!(refused(&system, "probe", r#"{ "source": "rtp0.fats", "for_ns": 1 }"#).contains("rtp0.fast"));
    assert!(refused(&system, "probe", r#"{ "for_ns": 3600000000001 }"#).contains("at most one hour"));
}

/// Calls of the operate role that cannot start any motion.
const STILL: [&str; 16] = [
    "raise_alarm",
    "clear_alarm",
    "acknowledge_alarms",
    "shelve_alarm",
    "unshelve_alarm",
    "request",
    "create",
    "delete",
    "keep_workspace",
    "forget_workspace",
    "teach_point",
    "rename_point",
    "delete_point",
    "step",
    "record",
    "stop_recording",
];

#[test]
fn each_call_of_operators_stops_or_moves_or_is_known_to_move_nothing() {
    let unknown: Vec<&str> = api::calls()
        .filter(|call| call.role == api::Role::Operate && !call.lasts && !call.stops && !call.moves && !STILL.contains(&call.name))
        .map(|call| call.name)
        .collect();
    assert_eq!(unknown, [""; 0]);
    assert!(api::calls().filter(|call| call.moves).all(|call| !call.stops && !STILL.contains(&call.name)));
}
