// SPDX-License-Identifier: Apache-2.0
//! Scenarios: a block that writes to an invalid address. Its source stops, its verbs end, the others continue, and a reset restores it.
use crate::common::*;
use model::refusal::Class;
use serde_json::json;
use supervisor::Limits;

fn program(rig: &Rig) -> (u64, u64, u64) {
    rig.define(verb(
        "bad",
        &[("crash", "crashing.crash")],
        json!({"cells": {"y": ["crash.y"]}, "initial": "start", "transitions": tau(&["start, fault -> start"]),
        "input_parameters": {"at": {"targets": ["crash.at"], "default": 3}}, "command_lists": lists(&[("start", &["+crash 1ms"])])}),
    ));
    rig.define(verb(
        "good",
        &[("count", "t.count")],
        json!({"cells": {"y": ["count.y"], "t": ["count.total"]}, "output_values": {"y": "count.y"},
        "conditions": {"halted": {"returns": ["y"]}}, "command_lists": lists(&[("start", &["+count 1ms"])])}),
    ));
    (rig.instance("bad", &["*@rtp0.fast"]), rig.instance("good", &["*@rtp0.fast"]), rig.instance("good", &["*@rtp1.other"]))
}

#[test]
fn a_signal_in_a_block_stops_its_source_and_ends_its_verbs() {
    on_both(|rig| {
        let (bad, beside, elsewhere) = program(rig);
        for id in [bad, beside, elsewhere] {
            rig.start(id);
        }
        rig.advance(10);
        let report = rig.wait(bad);
        assert_eq!((report.condition.as_str(), report.block.as_deref()), ("fault", Some("crash")));
        assert!(report.message.contains("'crash'") && report.message.contains("segmentation fault"), "{}", report.message);
        let report = rig.wait(beside);
        assert!(report.condition == "fault" && report.message.contains("stopped"), "{report:?}");
        assert_eq!(rig.system.state(elsewhere), "running");
        assert_eq!(class(rig.try_start(beside, json!({}), Limits::default())), Class::InvalidState, "the source stands");
        assert_eq!(class(rig.try_create(application("bad", &["*@rtp1.other"]))), Class::InvalidState, "the module takes no new instance");
        rig.system.halt(elsewhere).unwrap();
        assert_eq!(output(&rig.wait(elsewhere), "y"), 10.0);

        rig.system.reset().unwrap();
        rig.start(beside);
        rig.start_with(bad, json!({"at": 1000}));
        rig.advance(4);
        rig.system.halt(beside).unwrap();
        assert_eq!(output(&rig.wait(beside), "y"), 4.0);
        rig.system.halt(bad).unwrap();
        assert_eq!(rig.wait(bad).condition, "halted");
        for id in [bad, beside, elsewhere] {
            rig.system.delete(id).unwrap();
        }
    });
}

#[test]
fn a_signal_in_an_execute_is_contained_too() {
    on_both(|rig| {
        program(rig);
        rig.define(verb(
            "once",
            &[("crash", "crashing.crash"), ("watch", "t.watch")],
            json!({"cells": {"y": ["crash.y", "watch.u"], "w": ["watch.y"]},
            "input_parameters": {"at": {"targets": ["crash.at"], "default": 0}, "trace": {"targets": ["watch.trace"], "default": 500}},
            "command_lists": lists(&[("start", &["!crash", "+watch 1ms"])])}),
        ));
        let id = rig.instance("once", &["*@rtp0.fast"]);
        rig.start(id);
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.block.as_deref()), ("fault", Some("crash")));
        rig.system.reset().unwrap();
        rig.advance(3);
        assert_eq!(seen(500), []);
    });
}
