// SPDX-License-Identifier: Apache-2.0
//! Scenarios: two verbs that would write the same device: the later one is refused or queued, or the earlier one is aborted, as the
//! device declares.
use crate::common::*;
use model::refusal::Class;
use serde_json::{Value as Json, json};
use std::time::Duration;
use supervisor::{DeviceRequest, Limits, WaitResult};

/// Creates enabled devices j1 and j2, and verbs that count into their commanded values: `push` into one, `pair` into both.
fn arm(rig: &Rig, arbitration: &str) {
    rig.device_type(json!({"name": "Joint", "svvs": {"commanded": {"type_text": "double"}}, "arbitration": arbitration}));
    for joint in ["j1", "j2"] {
        let request: DeviceRequest = serde_json::from_value(json!({"device_type": "Joint"})).unwrap();
        rig.system.device(joint, request).unwrap_or_else(|r| panic!("{}", text(&r)));
        rig.system.enable(joint).unwrap();
    }
    rig.define(counting("push", &["a"], json!({"objects": {"a": {"device_type": "Joint"}}})));
    rig.define(counting("pair", &["a", "b"], json!({"objects": {"a": {"device_type": "Joint"}, "b": {"device_type": "Joint"}}})));
    rig.define(counting(
        "braked",
        &["a"],
        json!({"objects": {"a": {"device_type": "Joint"}}, "initial": "start", "ending": "brake",
               "command_lists": lists(&[("start", &["+a 1ms"]), ("brake", &["+a 1ms", "?3.5ms", "-a"])])}),
    ));
}

fn counting(name: &str, objects: &[&str], rest: Json) -> Json {
    let blocks: Vec<(&str, &str)> = objects.iter().map(|o| (*o, "t.count")).collect();
    let (mut chi, mut cells, mut limits) = (json!({}), json!({}), Vec::new());
    let mut commands = Vec::new();
    for object in objects {
        chi[format!("{object}.commanded")] = json!([format!("{object}.y")]);
        cells[format!("{object} total")] = json!([format!("{object}.total")]);
        limits.push(format!("{object}.limit"));
        commands.push(format!("+{object} 1ms"));
    }
    let commands: Vec<&str> = commands.iter().map(String::as_str).collect();
    let mut of = verb(
        name,
        &blocks,
        json!({"instantiation_parameters": chi, "cells": cells, "input_parameters": {"limit": {"targets": limits, "default": 4.0}},
               "output_values": {"y": "a.y"}, "conditions": {"reached": {"on": ["a.reached"], "returns": ["y"]}},
               "command_lists": lists(&[("start", &commands)])}),
    );
    for (key, value) in rest.as_object().unwrap() {
        of[key] = value.clone();
    }
    of
}

/// Creates an instance of a verb with devices as its objects.
fn on(rig: &Rig, verb: &str, name: &str, joints: &[&str], source: &str) -> u64 {
    let arguments: serde_json::Map<String, Json> = ["a", "b"].iter().zip(joints).map(|(o, j)| ((*o).into(), json!({"device": j}))).collect();
    rig.create(json!({"verb": verb, "name": name, "arguments": arguments, "placement": {"*": source}}))
}

fn states(rig: &Rig, ids: &[u64]) -> Vec<&'static str> {
    ids.iter().map(|id| rig.system.state(*id)).collect()
}

#[test]
fn a_second_writer_of_a_device_is_refused_with_both_names_unless_it_declares_otherwise() {
    on_both(|rig| {
        arm(rig, "refuse");
        let (first, second) = (on(rig, "push", "first", &["j1"], "rtp0.fast"), on(rig, "push", "second", &["j1"], "rtp1.other"));
        rig.start(first);
        let refused = rig.try_start(second, json!({}), Limits::default()).unwrap_err();
        assert_eq!(refused[0].class, Class::SecondWriter);
        assert!(["'first'", "'second'", "'j1.commanded'"].iter().all(|word| text(&refused).contains(word)), "{}", text(&refused));
        assert_eq!(states(rig, &[first, second]), ["running", "created"]);
    });
}

#[test]
fn queued_starts_follow_in_order_and_their_limits_count_running_time() {
    on_all(|rig| {
        arm(rig, "queue");
        let ids = ["p1", "p2", "p3"].map(|name| on(rig, "push", name, &["j1"], if name == "p2" { "rtp1.other" } else { "rtp0.fast" }));
        rig.start(ids[0]);
        for id in &ids[1..] {
            rig.try_start(*id, json!({}), Limits { time_limit_ns: Some(6 * MS), overruns: None, age_max_ns: None }).unwrap();
        }
        assert_eq!(states(rig, &ids), ["running", "queued", "queued"]);
        let refused = [rig.system.suspend(ids[1]), rig.system.resume(ids[1]), rig.system.delete(ids[1]), rig.try_start(ids[1], json!({}), Limits::default())];
        for call in refused {
            assert_eq!(class(call), Class::InvalidState);
        }
        rig.advance(5);
        assert_eq!(states(rig, &ids), ["ended", "running", "queued"]);
        let reports = ids.map(|id| rig.wait(id));
        assert!(reports.iter().all(|r| r.condition == "reached" && output(r, "y") == 4.0 && r.start == 1), "{reports:?}");
        assert!(reports[0].time_s <= reports[1].started_s && reports[1].time_s <= reports[2].started_s);
        let ends: Vec<String> = rig.logged("end");
        assert_eq!(ends, ["p1: reached", "p2: reached", "p3: reached"]);
    });
}

#[test]
fn a_queued_start_takes_all_or_nothing_and_nobody_overtakes_it() {
    on_both(|rig| {
        arm(rig, "queue");
        let (first, both) = (on(rig, "push", "first", &["j1"], "rtp0.fast"), on(rig, "pair", "both", &["j1", "j2"], "rtp0.fast"));
        let (late, again) = (on(rig, "push", "late", &["j2"], "rtp1.other"), on(rig, "push", "again", &["j1"], "rtp0.fast"));
        for id in [first, both, late, again] {
            rig.start(id);
        }
        assert_eq!(states(rig, &[first, both, late, again]), ["running", "queued", "queued", "queued"], "j2 is free, and reserved");
        rig.wait(first);
        assert_eq!(states(rig, &[first, both, late, again]), ["ended", "running", "queued", "queued"]);
        rig.wait(both);
        assert_eq!(states(rig, &[first, both, late, again]), ["ended", "ended", "running", "running"]);
    });
}

#[test]
fn a_halt_takes_a_start_out_of_the_queue_with_one_report() {
    on_both(|rig| {
        arm(rig, "queue");
        let ids = ["p1", "p2", "p3"].map(|name| on(rig, "push", name, &["j1"], "rtp0.fast"));
        ids.iter().for_each(|id| rig.start(*id));
        rig.system.halt(ids[1]).unwrap();
        let report = rig.wait_for(ids[1], 0).expect("it ends at once");
        assert_eq!((report.condition.as_str(), report.normal, report.outputs.len()), ("halted", true, 0));
        assert_eq!(class(rig.system.halt(ids[1])), Class::InvalidState);
        rig.wait(ids[0]);
        rig.system.halt(ids[2]).unwrap();
        rig.start(ids[1]);
        assert_eq!(rig.wait(ids[1]).start, 2);
        assert_eq!(rig.logged("end").len(), 4);
    });
}

#[test]
fn what_disables_or_stops_everything_ends_the_queue_and_begins_none_of_it() {
    on_both(|rig| {
        arm(rig, "queue");
        let ids = ["p1", "p2", "p3"].map(|name| on(rig, "push", name, &["j1"], "rtp0.fast"));
        for condition in ["device_disabled", "emergency_stop"] {
            let admitted = rig.logged("admission").len();
            ids.iter().for_each(|id| rig.start(*id));
            rig.advance(1);
            if condition == "emergency_stop" {
                rig.system.emergency_stop("tested").unwrap();
                rig.system.reset().unwrap();
            } else {
                assert!(matches!(rig.system.disable("j1", Duration::from_secs(60)).unwrap(), WaitResult::Done(())));
                rig.system.enable("j1").unwrap();
            }
            assert_eq!(ids.map(|id| rig.wait_for(id, 0).unwrap().condition), [condition; 3]);
            assert_eq!(rig.logged("admission").len(), admitted);
        }
    });
}

#[test]
fn a_later_start_aborts_the_holder_and_follows_in_the_next_firing() {
    on_all(|rig| {
        arm(rig, "abort");
        for (source, at) in [("rtp0.fast", [1.0, 2.0]), ("rtp1.other", [1.0, 2.0])] {
            let (first, second) =
                (on(rig, "push", &format!("first {source}"), &["j1"], "rtp0.fast"), on(rig, "push", &format!("second {source}"), &["j1"], source));
            rig.start_with(first, json!({"limit": 0.0}));
            rig.advance(5);
            assert_eq!(rig.read("j1.commanded"), 5.0);
            rig.start(second);
            rig.advance(1);
            assert_eq!(rig.read("j1.commanded"), at[0]);
            rig.advance(1);
            assert_eq!((rig.read("j1.commanded"), states(rig, &[first, second])), (at[1], vec!["ended", "running"]));
            let report = rig.wait(first);
            assert_eq!((report.condition.as_str(), report.normal), ("aborted", false));
            assert!(report.message.contains("'second"), "{}", report.message);
            rig.wait(second);
        }
    });
}

#[test]
fn an_aborted_holder_has_its_ending_list_and_the_latest_start_takes_the_place_of_those_that_wait() {
    on_both(|rig| {
        arm(rig, "abort");
        let first = on(rig, "braked", "first", &["j1"], "rtp0.fast");
        let (second, third) = (on(rig, "push", "second", &["j1"], "rtp0.fast"), on(rig, "push", "third", &["j1"], "rtp1.other"));
        rig.start_with(first, json!({"limit": 0.0}));
        rig.advance(2);
        rig.start(second);
        assert_eq!(states(rig, &[first, second]), ["running", "queued"]);
        rig.advance(1);
        rig.start(third);
        assert_eq!(rig.wait_for(second, 0).unwrap().condition, "aborted");
        assert_eq!(states(rig, &[first, third]), ["running", "queued"]);
        rig.advance(3);
        assert_eq!(states(rig, &[first, third]), ["ended", "running"]);
        assert_eq!((rig.wait(first).condition.as_str(), rig.wait(third).condition.as_str()), ("aborted", "reached"));
    });
}

#[test]
fn a_start_that_fails_aborts_nothing() {
    on_both(|rig| {
        arm(rig, "abort");
        let (first, second) = (on(rig, "push", "first", &["j1"], "rtp0.fast"), on(rig, "pair", "second", &["j1", "j2"], "rtp0.fast"));
        rig.start_with(first, json!({"limit": 0.0}));
        assert_eq!(class(rig.try_start(second, json!({"limit": [1.0]}), Limits::default())), Class::ValueRefused);
        assert!(matches!(rig.system.disable("j2", Duration::from_secs(60)).unwrap(), WaitResult::Done(())));
        assert_eq!(class(rig.try_start(second, json!({}), Limits::default())), Class::NotEnabled);
        assert_eq!(states(rig, &[first, second]), ["running", "created"]);
        rig.advance(3);
        assert_eq!(rig.read("j1.commanded"), 3.0);
    });
}
