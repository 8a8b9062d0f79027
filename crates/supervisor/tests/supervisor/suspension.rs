// SPDX-License-Identifier: Apache-2.0
//! Scenarios: the actuators of a suspended verb: they hold, they are safe, or the verb comes to rest first.
use crate::common::*;
use model::refusal::Class;
use serde_json::{Value as Json, json};

/// Creates a loopback part in `rtp0.fast` with a slew limit of 1000 per second, and a verb that pushes it with u = 4, written once.
fn pushed(rig: &Rig, suspend: &str) -> u64 {
    let options = json!({"parts": ["j1"], "initial": [0.0], "slew": 1000.0});
    rig.system.physical_device("rtp0", "arm", "loopback", &options, "rtp0.fast", None).unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.svv("at");
    rig.define(verb(
        "push",
        &[("drive", "t.drive"), ("again", "t.count"), ("read", "t.read_channel")],
        json!({"instantiation_parameters": {"effort": ["drive.channel"], "position": ["read.channel"], "at": ["read.y"]}, "cells": {"a": ["again.y"], "t": ["again.total"]},
               "input_parameters": {"u": {"targets": ["drive.u"], "default": 4.0}},
               "command_lists": lists(&[("start", &["!drive", "+again 1ms", "+read 1ms"])]), "suspend": suspend}),
    ));
    let channel = |name: &str| json!({"channel": {"device": "arm", "channel": format!("j1.{name}")}});
    rig.create(json!({"verb": "push", "arguments": {"effort": channel("effort"), "position": channel("position"), "at": {"svv": "at"}}, "placement": {"*": "rtp0.fast"}}))
}

/// Returns the distance that the part moves in each of the next ms, in steps of 1 ms · 1.
fn moves(rig: &Rig, count: usize) -> Vec<f64> {
    let mut before = rig.read("at");
    (0..count)
        .map(|_| {
            rig.advance(1);
            let moved = rig.read("at") - before;
            before += moved;
            (moved * 1e6).round() / 1e3
        })
        .collect()
}

#[test]
fn a_verb_that_is_suspended_safe_lets_go_and_takes_up_again_within_the_slew_limit() {
    on_both(|rig| {
        let id = pushed(rig, "safe");
        rig.start(id);
        assert_eq!(moves(rig, 7), [0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 4.0]);
        rig.system.suspend(id).unwrap();
        rig.advance(10);
        rig.system.resume(id).unwrap();
        let after = moves(rig, 7);
        assert!(after[1..].windows(2).all(|w| (w[1] - w[0]).abs() <= 1.0 + 1e-9), "{after:?}");
        assert_eq!(after[5..], [4.0, 4.0]);
        assert!(after[0] <= 4.0, "it stood still while it was suspended: {after:?}");
    });
}

#[test]
fn a_verb_that_holds_goes_on_pushing_while_it_is_suspended() {
    on_both(|rig| {
        let id = pushed(rig, "hold_last");
        rig.start(id);
        rig.advance(10);
        let before = rig.read("at");
        rig.system.suspend(id).unwrap();
        rig.advance(10);
        rig.system.resume(id).unwrap();
        rig.advance(1);
        assert!(((rig.read("at") - before) * 1e3 - 44.0).abs() < 1e-9);
    });
}

fn ramp(suspend: Json) -> Json {
    verb(
        "v",
        &[("ramp", "t.ramp"), ("count", "t.count")],
        json!({"instantiation_parameters": {"y": ["ramp.y"], "v": ["ramp.v"]}, "cells": {"c": ["count.y"], "t": ["count.total"]}, "initial": "go",
               "command_lists": lists(&[("go", &["+ramp 1ms", "?20ms", "-ramp", "+count 1ms"])]), "suspend": suspend}),
    )
}

#[test]
fn a_verb_that_comes_to_rest_is_suspended_when_it_says_so_and_goes_on_from_there() {
    let of = ramp(json!({"holding": [{"set": "ramp.holding", "until": "ramp.held"}]}));
    for place in ["rtp0.fast", "rtp1.other"] {
        on_all(|rig| {
            rig.svvs(&["y", "v"]);
            rig.define(of.clone());
            let id = rig.instance("v", &["y=y", "v=v", &format!("*@{place}")]);
            for _ in 0..2 {
                rig.start(id);
                rig.advance(5);
                assert_eq!(rig.read_all(&["y", "v"]), [1.0 + 2.0 + 3.0 * 3.0, 3.0]);
                rig.system.suspend(id).unwrap();
                assert_eq!((rig.system.state(id), rig.read_all(&["y", "v"])), ("suspended", vec![15.0, 0.0]));
                rig.advance(20);
                assert_eq!(rig.read("y"), 15.0);
                rig.system.resume(id).unwrap();
                rig.advance(2);
                assert_eq!(rig.read_all(&["y", "v"]), [18.0, 2.0]);
                rig.advance(20);
                let before = rig.system.now_ns();
                rig.system.suspend(id).unwrap();
                assert_eq!((rig.system.state(id), rig.system.now_ns() - before), ("suspended", 0), "the ramp is not active any more");
                rig.system.halt(id).unwrap();
                assert_eq!(rig.wait(id).condition, "halted");
            }
        });
    }
}

#[test]
fn a_suspension_that_waits_has_its_time_and_a_halt_ends_it() {
    let mut of = ramp(json!({"holding": [{"set": "ramp.holding", "until": "count.reached"}]}));
    of["command_lists"]["go"] = list(&["+ramp 1ms", "+count 1ms"]);
    of["ending_limit_ns"] = json!(3 * MS + MS / 2);
    on_both(|rig| {
        rig.svvs(&["y", "v"]);
        rig.define(of.clone());
        let id = rig.instance("v", &["y=y", "v=v", "*@rtp0.fast"]);
        rig.start(id);
        rig.advance(5);
        let before = rig.system.now_ns();
        rig.system.suspend(id).unwrap();
        assert_eq!((rig.system.state(id), rig.system.now_ns() - before, rig.read("v")), ("suspended", 3 * MS + MS / 2, 0.0));
        rig.system.halt(id).unwrap();
        rig.wait(id);
        rig.align();
        rig.start(id);
        rig.advance(3);
        assert_eq!(rig.read("v"), 3.0, "what was set is not set any more");
    });
}

#[test]
fn a_way_to_suspend_that_cannot_be_is_refused() {
    let rig = Rig::new(Link::Memory);
    rig.svvs(&["y", "v"]);
    let refused = |set: &str, until: &str, class: Class, words: &str| {
        let mut of = ramp(json!({"holding": [{"set": set, "until": until}]}));
        of["conditions"] = json!({"done": {"on": ["count.reached"]}});
        let refusals = rig.try_define(of).unwrap_err();
        assert!(refusals.iter().any(|r| r.class == class && r.message.contains(words)), "{}", text(&refusals));
    };
    refused("ramp.holdin", "ramp.held", Class::UnknownName, "holdin");
    refused("count.limit", "ramp.held", Class::TypeMismatch, "not an input or parameter of type bool");
    refused("ramp.holding", "ramp.v", Class::UnknownName, "is not a condition");
    refused("ramp.holding", "count.reached", Class::DefinitionError, "stands for it too");
}
