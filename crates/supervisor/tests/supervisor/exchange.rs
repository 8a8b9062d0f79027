// SPDX-License-Identifier: Apache-2.0
//! Scenarios: replacing the verb of a logical device while it runs.
use crate::common::*;
use model::refusal::Class;
use serde_json::{Value as Json, json};
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;
use supervisor::{DeviceRequest, WaitResult};

const LONG: Duration = Duration::from_secs(300);

/// Returns the trace number of this test, since tests run in parallel.
fn trace() -> i64 {
    static NEXT: AtomicI64 = AtomicI64::new(950);
    thread_local!(static OWN: i64 = NEXT.fetch_add(1, Ordering::Relaxed));
    OWN.with(|own| *own)
}

/// Returns a servo with the remaining members.
fn servo(name: &str, gain: f64, rest: Json) -> Json {
    let mut of = verb(
        name,
        &[("read", "t.read_channel"), ("follow", "t.follow"), ("count", "t.count"), ("trace", "t.watch")],
        json!({"instantiation_parameters": {"drive.position": ["read.channel"], "drive.effort": ["follow.channel"], "sensed": ["read.y", "follow.q"], "commanded": ["follow.u", "trace.u"]},
               "cells": {"n": ["count.y"], "life": ["count.total"], "t": ["trace.y"]},
               "input_parameters": {"trace": {"targets": ["trace.trace"], "default": trace()}},
               "output_values": {"n": "count.y"}, "conditions": {"device_disabled": {"returns": ["n"]}},
               "command_lists": lists(&[("start", &["!read", "+read 1ms", "+follow", "+count 1ms", "+trace 1ms", "ready"])])}),
    );
    of["blocks"]["follow"]["constants"] = json!({"gain": gain});
    for (key, value) in rest.as_object().unwrap() {
        of[key] = value.clone();
    }
    of
}

/// Creates an enabled joint at 0.5 with a servo, and a verb that moves its commanded value.
fn joint(rig: &Rig) -> u64 {
    let options = json!({"parts": ["j1"], "initial": [0.5], "slew": 2000.0});
    rig.system.physical_device("rtp0", "arm", "loopback", &options, "rtp0.fast", None).unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.define(servo("plain", 50.0, json!({})));
    rig.define(servo("stiff", 90.0, json!({})));
    rig.device_type(json!({"name": "Joint", "verb": "plain",
        "svvs": {"sensed": {"type_text": "double", "unit": "rad"}, "commanded": {"type_text": "double", "initial": {"copy_of": "sensed"}}}}));
    let request = json!({"device_type": "Joint", "source": "rtp0.fast", "arguments": {"drive": {"part": {"device": "arm", "part": "j1"}}}});
    let request: DeviceRequest = serde_json::from_value(request).unwrap();
    rig.system.device("j1", request).unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.define(verb(
        "glide",
        &[("glide", "t.glide")],
        json!({"objects": {"joint": {"device_type": "Joint"}}, "instantiation_parameters": {"joint.commanded": ["glide.present", "glide.y"]},
               "input_parameters": {"goal": {"targets": ["glide.goal"]}}, "conditions": {"arrived": {"on": ["glide.there"], "returns": []}},
               "command_lists": lists(&[("go", &["+glide 1ms"])])}),
    ));
    rig.create(json!({"verb": "glide", "arguments": {"joint": {"device": "j1"}}, "placement": {"*": "rtp1.other"}}))
}

fn enable(rig: &Rig) {
    rig.system.enable("j1").unwrap();
    assert!(matches!(rig.system.wait_enabled("j1", Some(rig.system.now_ns() + 50 * MS), LONG).unwrap(), WaitResult::Done(true)));
}

/// Checks the servo's own trace: one row per ms, without a gap, each at most `stride` from its predecessor.
fn check_trace(stride: f64) -> usize {
    let rows = seen(trace());
    for w in rows.windows(2) {
        assert_eq!(w[1].now_ns - w[0].now_ns, MS, "no firing without a servo");
        assert_eq!(w[1].time_ns - w[0].time_ns, MS, "its running time goes on");
        assert_eq!(w[1].number, w[0].number + 1);
        assert!((w[1].u - w[0].u).abs() <= stride + 1e-12);
    }
    rows.len()
}

#[test]
fn a_running_servo_is_exchanged_between_two_firings_and_keeps_its_states_and_users() {
    on_both(|rig| {
        seen(trace());
        let id = joint(rig);
        enable(rig);
        rig.start_with(id, json!({"goal": 0.6}));
        rig.advance(30);
        for verb in ["stiff", "plain", "stiff"] {
            let before = rig.read("j1.sensed");
            rig.system.exchange_verb("j1", verb, None).unwrap_or_else(|r| panic!("{}", text(&r)));
            assert_eq!((rig.system.state(id), rig.system.device_state("j1").unwrap()), ("running", "moving"));
            assert_eq!(rig.read("j1.sensed"), before, "no time has passed");
            rig.advance(20);
            assert!(rig.read("j1.sensed") > before);
        }
        assert_eq!(rig.wait(id).condition, "arrived");
        rig.advance(100);
        assert!((rig.read("j1.sensed") - 0.6).abs() < 1e-3);
        let rows = check_trace(0.002);
        rig.system.disable("j1", LONG).unwrap();
        let ends = rig.logged("end");
        assert_eq!(ends.iter().filter(|e| e.contains("exchanged for")).count(), 3, "{ends:?}");
        assert!(rows > 180, "{rows}");
        let names = rig.system.names();
        assert_eq!(names.instances.len(), 2, "the old ones are gone: {names:?}");
        enable(rig);
        rig.advance(3);
    });
}

#[test]
fn an_exchange_that_is_refused_changes_nothing() {
    on_both(|rig| {
        seen(trace());
        let id = joint(rig);
        enable(rig);
        rig.start_with(id, json!({"goal": 0.6}));
        rig.advance(5);
        let refused = |verb: &str, class_of: Class, words: &str| {
            let refusals = rig.system.exchange_verb("j1", verb, None).unwrap_err();
            assert!(refusals[0].class == class_of && text(&refusals).contains(words), "{}", text(&refusals));
        };
        rig.define(servo("other", 50.0, json!({"input_parameters": {"trace": {"targets": ["trace.trace"]}}})));
        rig.define(servo(
            "pushes",
            50.0,
            json!({"cells": {"n": ["count.y"], "t": ["trace.y"]},
            "instantiation_parameters": {"drive.position": ["read.channel"], "drive.effort": ["follow.channel"], "sensed": ["read.y", "follow.q"],
                                         "commanded": ["follow.u", "trace.u", "count.total"]}}),
        ));
        refused("nothing", Class::UnknownName, "nothing");
        refused("plain", Class::InUse, "j1.plain");
        refused("other", Class::CallError, "'trace'");
        refused("pushes", Class::SecondWriter, "'glide#1'");
        let reads = verb(
            "reads",
            &[("probe", "t.probe")],
            json!({"instantiation_parameters": {"u": ["probe.u"]}, "cells": {"y": ["probe.y"]},
            "command_lists": lists(&[("start", &["+probe"])])}),
        );
        rig.define(reads);
        let reader = rig.instance("reads", &["u=j1.sensed", "*@rtp0.fast"]);
        refused("stiff", Class::InvalidState, "reads its SVV");
        rig.system.delete(reader).unwrap();
        rig.advance(5);
        assert_eq!((check_trace(0.002), rig.system.state(id)), (10, "running"));
        rig.system.exchange_verb("j1", "stiff", None).unwrap();
        rig.advance(1);
    });
}

#[test]
fn the_verb_of_a_disabled_device_is_exchanged_for_the_next_time() {
    on_both(|rig| {
        seen(trace());
        joint(rig);
        rig.system.exchange_verb("j1", "stiff", None).unwrap();
        assert_eq!(rig.system.device_state("j1").unwrap(), "disabled");
        enable(rig);
        rig.advance(3);
        assert_eq!(check_trace(0.0), 3);
        assert!(rig.logged("start").last().unwrap().starts_with("j1.stiff"), "{:?}", rig.logged("start"));
    });
}
