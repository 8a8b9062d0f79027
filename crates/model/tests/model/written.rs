// SPDX-License-Identifier: Apache-2.0
//! Checks that short forms of definitions mean the same as the long ones.
use model::definition::{Graph, Verb};
use serde_json::{Value, json};

fn same_verb(short: Value, long: Value) {
    let read = |of: Value| serde_json::from_value::<Verb>(of).expect("a verb");
    assert_eq!(read(short), read(long));
}

fn refused(of: Value) -> String {
    serde_json::from_value::<Verb>(of).expect_err("it is no verb").to_string()
}

fn with_commands(commands: Value) -> Value {
    json!({"name": "v", "blocks": {}, "command_lists": {"start": commands}})
}

#[test]
fn a_verb_in_short_is_the_verb_in_long() {
    same_verb(
        json!({"name": "v", "blocks": {"a": "library.gain", "b": {"block": "library.gain", "constants": {"k": 2.0}}},
            "objects": {"arm": "Joint"}, "instantiation_parameters": {"u": "a.u"}, "cells": {"c": ["a.y", "b.u"]},
            "input_parameters": {"k": "a.k", "l": ["a.k", "b.k"], "m": {"targets": "b.k", "default": 1}},
            "command_lists": {"start": [{"activate": "a", "every": "1.5 ms"}]}, "requires": {"arm.homed": "NotHomed"},
            "conditions": {"done": "a.done", "gone": ["a.x", "b.x"], "bad": {"on": "a.bad", "raises": "Collision", "returns": "y"}}}),
        json!({"name": "v", "blocks": {"a": {"block": {"subroutine": "library.gain"}}, "b": {"block": {"subroutine": "library.gain"}, "constants": {"k": 2.0}}},
            "objects": {"arm": {"device_type": "Joint", "each": false}}, "instantiation_parameters": {"u": ["a.u"]}, "cells": {"c": ["a.y", "b.u"]},
            "input_parameters": {"k": {"targets": ["a.k"]}, "l": {"targets": ["a.k", "b.k"]}, "m": {"targets": ["b.k"], "default": 1}},
            "command_lists": {"start": {"commands": [{"command": "activate", "block": "a", "every_ns": 1_500_000}]}},
            "requires": {"arm.homed": {"raises": "NotHomed"}},
            "conditions": {"done": {"on": ["a.done"]}, "gone": {"on": ["a.x", "b.x"]}, "bad": {"on": ["a.bad"], "raises": true, "returns": ["y"]}}}),
    );
}

#[test]
fn commands_in_short_are_commands_in_long() {
    same_verb(
        with_commands(json!([{"install": "a"}, {"install": ["a", "b"]}, {"execute": "a"}, {"deactivate": "a"}, {"ready": true}, {"wait": true},
            {"wait": "0.5 s"}, {"wait": "a.done"}, {"wait": ["a.done", "b.done"]}, {"activate": "a", "tunable": true, "every": "20 ms", "budget": "1 ms"}])),
        with_commands(
            json!({"commands": [{"command": "install", "blocks": ["a"]}, {"command": "install", "blocks": ["a", "b"]}, {"command": "execute", "block": "a"},
            {"command": "deactivate", "block": "a"}, {"command": "ready"}, {"command": "wait"}, {"command": "wait", "time_ns": 500_000_000},
            {"command": "wait", "conditions": ["a.done"]}, {"command": "wait", "conditions": ["a.done", "b.done"]},
            {"command": "activate", "block": "a", "every_ns": 20_000_000, "tunable": true, "budget_ns": 1_000_000}]}),
        ),
    );
}

#[test]
fn what_is_neither_says_so() {
    assert!(refused(with_commands(json!([{"executes": "a"}]))).contains("a command has none of install, execute, activate, deactivate, wait, ready"));
    assert!(refused(with_commands(json!([{"activate": "a", "every": "20 mm"}]))).contains("is not a command"));
    assert!(refused(with_commands(json!([{"command": "activate"}]))).contains("missing field `block`"));
    assert!(refused(with_commands(json!([{"command": "activates", "block": "a"}]))).contains("unknown variant `activates`"));
    assert!(refused(with_commands(json!("a"))).contains("commands, or an object with commands"));
    assert!(refused(json!({"name": "v", "blocks": {"a": 5}, "command_lists": {}})).contains("a name or an object"));
    assert!(refused(json!({"name": "v", "blocks": {"a": ["b"]}, "command_lists": {}})).contains("a name or an object"));
    assert!(refused(json!({"name": "v", "blocks": {}, "command_lists": {}, "requires": {"m": "Nothing"}})).contains("'Nothing' is not an error class"));
}

#[test]
fn a_graph_in_short_is_the_graph_in_long() {
    let inner = json!({"name": "i", "blocks": {"k": "library.gain"}, "inputs": {"u": "k.u"}, "outputs": {"y": ["k.y"]}});
    let short: Graph =
        serde_json::from_value(json!({"name": "g", "blocks": {"i": {"block": {"graph": inner}}}, "modes": {"i.u": "asynchronous"}})).expect("a graph");
    let again: Graph = serde_json::from_value(serde_json::to_value(&short).expect("JSON")).expect("a graph");
    assert_eq!(short, again);
}
