// SPDX-License-Identifier: Apache-2.0
//! Scenarios: physical and logical devices, and the emergency stop.
use crate::common::*;
use model::refusal::Class;
use model::value::Value;
use serde_json::{Value as Json, json};
use std::time::Duration;
use supervisor::{DeviceRequest, Limits, WaitResult};

const LONG: Duration = Duration::from_secs(300);

/// Creates a loopback device with two parts in `rtp0.fast`, and joints j1 and j2 that follow their goals.
fn arm(rig: &Rig, options: Json) {
    let mut all = json!({"parts": ["j1", "j2"], "initial": [0.5, 1.5]});
    for (key, value) in options.as_object().unwrap() {
        all[key] = value.clone();
    }
    rig.system.physical_device("rtp0", "arm", "loopback", &all, "rtp0.fast", None).unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.define(verb(
        "servo",
        &[("read", "t.read_channel"), ("drive", "t.drive"), ("watch", "t.watch")],
        json!({"instantiation_parameters": {"drive.position": ["read.channel"], "drive.effort": ["drive.channel"], "sensed": ["read.y"], "commanded": ["watch.u"]},
               "cells": {"effort": ["watch.y", "drive.u"]},
               "input_parameters": {"kp": {"targets": ["drive.gain"], "tunable": true}},
               "command_lists": lists(&[("start", &["!read", "+read 1ms", "+watch 1ms", "+drive 1ms", "ready"])])}),
    ));
    rig.device_type(json!({"name": "Joint", "verb": "servo",
        "svvs": {"sensed": {"type_text": "double", "unit": "rad"}, "commanded": {"type_text": "double", "initial": {"copy_of": "sensed"}}},
        "parameters": {"kp": {"default": 1.0, "tunable": true}}}));
    for joint in ["j1", "j2"] {
        let request = json!({"device_type": "Joint", "source": "rtp0.fast", "arguments": {"drive": {"part": {"device": "arm", "part": joint}}}});
        let request: DeviceRequest = serde_json::from_value(request).unwrap();
        rig.system.device(joint, request).unwrap_or_else(|r| panic!("{}", text(&r)));
    }
    rig.define(verb(
        "push",
        &[("count", "t.count")],
        json!({"objects": {"joint": {"device_type": "Joint"}}, "instantiation_parameters": {"joint.commanded": ["count.y"]}, "cells": {"t": ["count.total"]},
               "input_parameters": {"start": {"targets": ["count.start"], "default": 0.0}},
               "output_values": {"y": "count.y"}, "conditions": {"halted": {"returns": ["y"]}},
               "command_lists": lists(&[("start", &["+count 1ms"])])}),
    ));
}

fn enable(rig: &Rig, device: &str) {
    rig.system.enable(device).unwrap_or_else(|r| panic!("{}", text(&r)));
    let until_ns = Some(rig.system.now_ns() + 1_000 * MS);
    assert!(matches!(rig.system.wait_enabled(device, until_ns, LONG).unwrap(), WaitResult::Done(true)));
}

fn push(rig: &Rig, joint: &str) -> u64 {
    rig.create(json!({"verb": "push", "name": format!("push {joint}"), "arguments": {"joint": {"device": joint}}, "placement": {"*": "rtp0.fast"}}))
}

#[test]
fn what_starts_as_a_copy_is_the_present_before_the_loop_closes() {
    on_both(|rig| {
        arm(rig, json!({}));
        for (joint, home) in [("j1", 0.5), ("j2", 1.5)] {
            assert_eq!(rig.system.device_state(joint).unwrap(), "disabled");
            enable(rig, joint);
            assert_eq!(rig.read_all(&[&format!("{joint}.sensed"), &format!("{joint}.commanded")]), [home, home]);
            assert_eq!(rig.system.device_state(joint).unwrap(), "standstill");
        }
        rig.advance(3);
        // x' = u, with u the commanded value: it moves from its previous position.
        assert!(rig.read("j1.sensed") > 0.5);
        rig.write("j1.commanded", 0.0);
        rig.advance(2);
        let at = rig.read("j1.sensed");
        rig.advance(5);
        assert_eq!(rig.read("j1.sensed"), at);
    });
}

#[test]
fn a_verb_starts_only_on_devices_that_are_enabled() {
    on_both(|rig| {
        arm(rig, json!({}));
        let id = push(rig, "j1");
        let refused = rig.try_start(id, json!({}), Limits::default()).unwrap_err();
        assert!(refused[0].class == Class::NotEnabled && text(&refused).contains("'j1'"), "{}", text(&refused));
        enable(rig, "j1");
        rig.start(id);
        assert_eq!(rig.system.device_state("j1").unwrap(), "moving");
        assert_eq!(class(rig.system.delete_device("j1")), Class::InvalidState);
        rig.advance(3);
        rig.system.halt(id).unwrap();
        rig.wait(id);
        assert!(matches!(rig.system.disable("j1", LONG).unwrap(), WaitResult::Done(())));
        assert_eq!(rig.system.device_state("j1").unwrap(), "disabled");
        assert_eq!(class(rig.system.delete_device("j1")), Class::InvalidState, "an instance is bound to it");
        rig.system.delete(id).unwrap();
        rig.system.delete_device("j1").unwrap();
        assert_eq!(class(rig.system.device_state("j1")), Class::UnknownName);
        assert_eq!(class(rig.system.read(&["j1.sensed".to_owned()])), Class::UnknownName);
    });
}

#[test]
fn disabling_ends_the_users_first() {
    on_both(|rig| {
        arm(rig, json!({}));
        enable(rig, "j1");
        let id = push(rig, "j1");
        rig.start(id);
        rig.advance(2);
        assert!(matches!(rig.system.disable("j1", LONG).unwrap(), WaitResult::Done(())));
        assert_eq!(rig.wait(id).condition, "device_disabled");
        assert_eq!(rig.logged("end"), ["push j1: device_disabled: device 'j1' was disabled", "j1.servo: device_disabled: device 'j1' was disabled"]);
        assert_eq!(class(rig.try_start(id, json!({}), Limits::default())), Class::NotEnabled);
        enable(rig, "j1");
        rig.start(id);
    });
}

#[test]
fn a_device_that_fails_ends_its_servos_and_their_users() {
    on_both(|rig| {
        arm(rig, json!({"fail_at_ns": 20 * MS}));
        enable(rig, "j1");
        enable(rig, "j2");
        let (first, second) = (push(rig, "j1"), push(rig, "j2"));
        rig.start(first);
        rig.start(second);
        for id in [first, second] {
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), report.normal), ("device_lost", false));
        }
        assert_eq!((rig.system.device_state("j1").unwrap(), rig.system.device_state("j2").unwrap()), ("fault", "fault"));
        assert_eq!(rig.logged("end").len(), 4);
    });
}

#[test]
fn a_reading_that_is_no_number_is_a_fault_of_the_servo_and_its_user_loses_the_device() {
    on_both(|rig| {
        arm(rig, json!({"nan_at_ns": 10 * MS}));
        enable(rig, "j1");
        let id = push(rig, "j1");
        rig.start(id);
        assert_eq!(rig.wait(id).condition, "device_lost");
        assert!(rig.logged("end").iter().any(|e| e.starts_with("j1.servo: fault")), "{:?}", rig.logged("end"));
    });
}

#[test]
fn an_emergency_stop_ends_everything_latches_and_is_reset() {
    on_both(|rig| {
        arm(rig, json!({}));
        enable(rig, "j1");
        let (id, idle) = (push(rig, "j1"), push(rig, "j2"));
        rig.start(id);
        rig.advance(3);
        rig.system.emergency_stop("a person came in").unwrap();
        let report = rig.wait(id);
        assert!(report.condition == "emergency_stop" && report.message == "a person came in", "{report:?}");
        let at = rig.read("j1.sensed");
        rig.advance(5);
        assert_eq!(rig.read("j1.sensed"), at, "its effort is safe");
        for refused in [rig.try_start(id, json!({}), Limits::default()), rig.try_start(idle, json!({}), Limits::default()), rig.system.enable("j1").map(|_| ())]
        {
            assert_eq!(class(refused), Class::EmergencyStopped);
        }
        rig.system.reset().unwrap();
        enable(rig, "j1");
        rig.start(id);
        rig.advance(3);
        assert!(rig.read("j1.sensed") > at);
    });
}

#[test]
fn a_tunable_parameter_of_a_device_acts_at_once() {
    on_both(|rig| {
        arm(rig, json!({}));
        enable(rig, "j1");
        rig.write("j1.commanded", 1.0);
        rig.advance(2);
        rig.system.set_device_parameter("j1", "kp", Value::Number(0.0)).unwrap();
        rig.advance(2);
        let at = rig.read("j1.sensed");
        rig.advance(5);
        assert_eq!(rig.read("j1.sensed"), at);
        assert_eq!(rig.system.device_parameter("j1", "kp").unwrap(), Value::Number(0.0));
        assert_eq!(class(rig.system.set_device_parameter("j1", "kq", Value::Number(0.0))), Class::UnknownName);
    });
}

#[test]
fn closing_ends_users_and_servos() {
    on_both(|rig| {
        arm(rig, json!({}));
        enable(rig, "j1");
        let id = push(rig, "j1");
        rig.start(id);
        rig.advance(2);
        rig.system.close();
        rig.system.close();
        assert_eq!(rig.system.report(id).unwrap().unwrap().condition, "halted");
        assert_eq!(rig.system.device_state("j1").unwrap(), "disabled");
        assert_eq!(class(rig.system.write("j1.commanded", &Value::Number(1.0))), Class::InvalidState);
    });
}

#[test]
fn what_ended_while_its_device_was_away_commands_nothing_when_it_is_opened_again() {
    on_both(|rig| {
        arm(rig, json!({"fail_at_ns": 20 * MS}));
        enable(rig, "j1");
        let id = push(rig, "j1");
        rig.try_start(id, json!({"start": 7.0}), Limits::default()).unwrap();
        assert_eq!(rig.wait(id).condition, "device_lost");
        rig.system.reset().unwrap_or_else(|r| panic!("{}", text(&r)));
        rig.advance(3);
        // x' = u: it is not enabled, so it stays where it was opened.
        let position = || rig.read("arm.j1.position");
        let opened = position();
        rig.advance(5);
        assert_eq!((opened, position()), (0.5, 0.5));
    });
}
