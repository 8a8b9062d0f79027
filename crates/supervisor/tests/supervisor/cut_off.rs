// SPDX-License-Identifier: Apache-2.0
//! Scenarios: the fate of running verbs when the programming system that started them is cut off, and the reports that it finds later.
use crate::common::*;
use model::refusal::Class;
use serde_json::{Value as Json, json};
use supervisor::DeviceRequest;

/// Creates an enabled joint `j1` on a loopback device, whose own verb has this policy.
fn joint(rig: &Rig, policy: Json) -> u64 {
    rig.system.physical_device("rtp0", "arm", "loopback", &json!({"parts": ["j1"]}), "rtp0.fast", None).unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.define(verb(
        "servo",
        &[("read", "t.read_channel"), ("drive", "t.drive"), ("watch", "t.watch")],
        json!({"instantiation_parameters": {"drive.position": ["read.channel"], "drive.effort": ["drive.channel"], "sensed": ["read.y"], "commanded": ["watch.u"]},
               "cells": {"effort": ["watch.y", "drive.u"]}, "if_cut_off": policy,
               "command_lists": lists(&[("start", &["!read", "+read 1ms", "+watch 1ms", "+drive 1ms", "ready"])])}),
    ));
    rig.device_type(json!({"name": "Joint", "verb": "servo", "svvs": {"sensed": {"type_text": "double"}, "commanded": {"type_text": "double"}}}));
    let request = json!({"device_type": "Joint", "source": "rtp0.fast", "arguments": {"drive": {"part": {"device": "arm", "part": "j1"}}}});
    let request: DeviceRequest = serde_json::from_value(request).unwrap();
    rig.system.device("j1", request).unwrap_or_else(|r| panic!("{}", text(&r)));
    let own = rig.system.enable("j1").unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.advance(2);
    own
}

/// Creates and starts a verb with this policy that pushes the joint.
fn push(rig: &Rig, policy: Json) -> u64 {
    rig.define(verb(
        "push",
        &[("count", "t.count")],
        json!({"objects": {"joint": {"device_type": "Joint"}}, "instantiation_parameters": {"joint.commanded": ["count.y"]}, "cells": {"t": ["count.total"]},
               "command_lists": lists(&[("start", &["+count 1ms"])]), "if_cut_off": policy}),
    ));
    let id = rig.create(json!({"verb": "push", "name": "push", "arguments": {"joint": {"device": "j1"}}, "placement": {"*": "rtp0.fast"}}));
    rig.start(id);
    rig.advance(3);
    id
}

fn abandoned(rig: &Rig, instances: &[u64]) {
    rig.system.abandon(instances, "panel").unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.advance(3);
}

#[test]
fn an_action_is_halted_and_a_servo_continues_where_nothing_is_said() {
    on_both(|rig| {
        let (own, id) = (joint(rig, Json::Null), push(rig, Json::Null));
        abandoned(rig, &[own, id]);
        let report = rig.system.report(id).unwrap().expect("it has ended");
        assert_eq!((report.condition.as_str(), report.message.as_str()), ("halted", "programming system 'panel' was cut off"));
        assert!(!report.normal, "nobody asked for this halt");
        assert_eq!(rig.system.device_state("j1").unwrap(), "standstill");
        assert_eq!(rig.system.state(own), "running");
    });
}

#[test]
fn what_continues_does_not_notice() {
    on_both(|rig| {
        let (own, id) = (joint(rig, Json::Null), push(rig, json!("continue")));
        abandoned(rig, &[own, id]);
        assert_eq!((rig.system.state(id), rig.system.device_state("j1").unwrap()), ("running", "moving"));
    });
}

#[test]
fn what_is_to_be_safe_ends_with_its_devices_at_their_safe_values() {
    on_both(|rig| {
        let (own, id) = (joint(rig, Json::Null), push(rig, json!("safe")));
        let before = rig.read("j1.sensed");
        abandoned(rig, &[id]);
        assert_eq!(rig.system.report(id).unwrap().expect("it has ended").condition, "aborted");
        assert_eq!(rig.system.report(own).unwrap().expect("it has ended").condition, "aborted");
        assert_eq!(rig.system.device_state("j1").unwrap(), "disabled");
        let after = rig.read("j1.sensed");
        rig.advance(10);
        assert_eq!(rig.read("j1.sensed"), after, "its effort is 0, the safe value (it was at {before})");
    });
}

#[test]
fn a_servo_may_be_told_to_stop() {
    on_both(|rig| {
        let (own, id) = (joint(rig, json!("halt")), push(rig, json!("continue")));
        abandoned(rig, &[own]);
        assert_eq!(rig.system.report(id).unwrap().expect("its device is gone").condition, "device_disabled");
        assert_eq!(rig.system.device_state("j1").unwrap(), "disabled");
    });
}

#[test]
fn what_has_ended_or_is_deleted_is_passed_over() {
    on_both(|rig| {
        let (own, id) = (joint(rig, Json::Null), push(rig, Json::Null));
        rig.system.halt(id).unwrap();
        rig.wait(id);
        rig.system.delete(id).unwrap();
        abandoned(rig, &[id, 4_711]);
        assert_eq!(rig.system.state(own), "running");
    });
}

#[test]
fn end_reports_are_numbered_and_can_be_had_later() {
    on_both(|rig| {
        joint(rig, Json::Null);
        let id = push(rig, Json::Null);
        for _ in 0..3 {
            rig.system.halt(id).unwrap();
            rig.wait(id);
            rig.start(id);
            rig.advance(1);
        }
        let ends = rig.system.ends_since(0);
        assert_eq!(ends.iter().map(|end| (end.number, end.instance, end.report.start)).collect::<Vec<_>>(), [(0, id, 1), (1, id, 2), (2, id, 3)]);
        assert_eq!(rig.system.ends_since(2).len(), 1);
        assert!(rig.system.ends_since(3).is_empty());
    });
}

#[test]
fn parts_of_a_composition_must_agree() {
    on_both(|rig| {
        joint(rig, Json::Null);
        let part = |name: &str, policy: &str| {
            verb(
                name,
                &[("count", "t.count")],
                json!({"cells": {"y": ["count.y"], "t": ["count.total"]}, "conditions": {"reached": {"on": ["count.reached"]}},
                       "command_lists": lists(&[("start", &["+count 1ms"])]), "if_cut_off": policy}),
            )
        };
        let composition = json!({"name": "both", "parts": {"a": part("first", "halt"), "b": part("second", "continue")}});
        let composition = serde_json::from_value(composition).expect("a composition");
        let refused = rig.system.compose(&composition).map(|_| ()).unwrap_err();
        let conflict = refused.iter().find(|r| r.class == Class::CompositionConflict).expect("they disagree");
        assert!(conflict.to_string().contains("do different things when the programming system is cut off"), "{conflict}");
    });
}
