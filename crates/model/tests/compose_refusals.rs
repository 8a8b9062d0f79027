// SPDX-License-Identifier: Apache-2.0
//! Parts that do not go together: each refusal names both and says what to do, and all come at once.
mod common;
use common::*;
use model::Composition;
use serde_json::{Value, json};

fn part(name: &str, rest: Value) -> Value {
    let mut part = verb(
        &[("s", "lib.signal")],
        json!({"name": name, "instantiation_parameters": {"y": ["s.y"]}, "input_parameters": {"limit": {"targets": ["s.above"], "default": 3.0}},
            "output_values": {"last": "s.y"}, "command_lists": start(&["+s 1ms"]), "conditions": {"enough": {"on": ["s.above"], "returns": ["last"]}}}),
    );
    merge(&mut part, rest);
    part
}

/// What is refused of parts `a` and `b`, which may differ from the plain one, and further words of the composition.
fn refused(a: Value, b: Value, rest: Value) -> String {
    let mut whole = json!({"name": "whole", "parts": {"a": part("first", a), "b": part("second", b)},
        "transitions": [{"from": "a", "condition": "enough", "to": "b"}], "place": {"file": "c.py", "line": 9}});
    merge(&mut whole, rest);
    let whole: Composition = serde_json::from_value(whole).expect("a composition");
    let refusals = model::compose(&whole, &cell()).err().unwrap_or_default();
    texts(&refusals)
}

fn plain() -> Value {
    json!({})
}

#[test]
fn zz_print() {
    let line = |from: &str, condition: &str, to: &str| json!({"transitions": [{"from": from, "condition": condition, "to": to}]});
    let wired = |name: &str, more: Value| { let mut v = verb(&[("s", "lib.signal"), ("g", "lib.gain")], json!({"name": name, "instantiation_parameters": {"y": ["s.y"]}, "cells": {"w": ["g.y"]}, "command_lists": start(&["+s 1ms", "+g"]), "conditions": {"enough": {"on": ["s.above"], "returns": []}}})); merge(&mut v, more); v };
    let with = |a: Value, b: Value, rest: Value| { let mut w = json!({"name": "whole", "parts": {"a": a, "b": b}, "transitions": [{"from": "a", "condition": "enough", "to": "b"}], "place": {"file": "c.py", "line": 9}}); merge(&mut w, rest); let w: Composition = serde_json::from_value(w).expect("x"); texts(&model::compose(&w, &cell()).err().unwrap_or_default()) };
    let reader = |mode: Value| verb(&[("g", "lib.gain")], json!({"name": "second", "instantiation_parameters": {"y": ["g.u"]}, "modes": mode, "command_lists": start(&["+g"])}));
    let goal = |name: &str, input: &str| verb(&[("r", "lib.relaxed")], json!({"name": name, "instantiation_parameters": {"u": ["r.u"]}, "input_parameters": {input: {"targets": ["r.u"]}}, "command_lists": start(&["+r 1ms"])}));
    let waits = json!({"command_lists": start(&["+s 1ms", "?s.above", "-s"])});
    let apart = json!({"b.y": "z", "b.last": "z_last"});
    let together = |rename: Value| json!({"together": true, "transitions": [], "rename": rename});
    let own = json!({"command_lists": {"start": list(&["+s 1ms"]), "back": list(&["+s 2ms"])}, "initial": "start", "transitions": [{"from": "start", "condition": "enough", "to": "back"}]});
    let all = [
        ("no parts", { let w: Composition = serde_json::from_value(json!({"name": "w", "parts": {}})).unwrap(); texts(&model::compose(&w, &cell()).err().unwrap()) }),
        ("part wrong", refused(json!({"output_values": {"last": "s.x"}}), plain(), plain())),
        ("types", with(part("first", plain()), verb(&[("n", "lib.narrow")], json!({"name": "second", "instantiation_parameters": {"y": ["n.u"]}, "command_lists": start(&["+n"])})), plain())),
        ("units", with(goal("first", "u0"), verb(&[("n", "lib.pid")], json!({"name": "second", "instantiation_parameters": {"u": ["n.effort"]}, "input_parameters": {"kp": {"targets": ["n.kp"]}, "l": {"targets": ["n.limit"]}, "m": {"targets": ["n.measured"]}, "sp": {"targets": ["n.setpoint"]}}, "command_lists": start(&["+n 1ms"])})), json!({"transitions": [{"from": "a", "condition": "completed", "to": "b"}]}))),
        ("kinds", with(verb(&[("r", "lib.read_channel")], json!({"name": "first", "instantiation_parameters": {"y.x": ["r.channel"]}, "command_lists": start(&["+r 1ms"])})), verb(&[("r", "lib.write_channel")], json!({"name": "second", "instantiation_parameters": {"y.x": ["r.channel"]}, "input_parameters": {"u": {"targets": ["r.u"]}}, "command_lists": start(&["+r 1ms"])})), json!({"transitions": [{"from": "a", "condition": "completed", "to": "b"}]}))),
        ("input units", refused(json!({"input_parameters": {"limit": {"unit": "N"}}}), json!({"input_parameters": {"limit": {"unit": "rad"}}}), plain())),
        ("objects", with(movement(), { let mut m = movement(); m["objects"]["arm"]["each"] = json!(false); m }, json!({"transitions": [{"from": "a", "condition": "arrived", "to": "b"}]}))),
        ("outputs", with(part("first", plain()), wired("second", json!({"blocks": {"n": {"block": {"subroutine": "lib.narrow"}}}, "cells": {"c": ["n.u"]}, "output_values": {"last": "n.y"}})), plain())),
        ("label", refused(plain(), plain(), json!({"parts": {"c.d": part("third", plain())}}))),
        ("rename nothing", refused(plain(), plain(), json!({"rename": {"a.limt": "x", "c.limit": "x", "limit": "x", "b.limit": "x.y", "b.enough": "completed"}}))),
        ("rename twice", refused(plain(), plain(), json!({"rename": {"a.y": "limit"}}))),
        ("preset nothing", refused(plain(), plain(), json!({"preset": {"a.y": 1, "b.limit": "red"}}))),
        ("share", refused(plain(), plain(), json!({"share": ["a", "t"]}))),
        ("share constants", refused(json!({"blocks": {"s": {"constants": {"frequency": 2.0}}}}), plain(), json!({"share": ["s"]}))),
        ("share blocks", with(part("first", plain()), with_gain(), json!({"share": ["s"], "transitions": []}))),
        ("share binding", refused(plain(), plain(), json!({"share": ["s"], "rename": {"b.y": "z"}}))),
        ("share label", { let mut p = part("first", plain()); p["name"] = json!("s"); let w: Composition = serde_json::from_value(json!({"name": "whole", "parts": {"s": p, "b": part("second", plain())}, "share": ["s"], "transitions": [{"from": "s", "condition": "enough", "to": "b"}]})).unwrap(); texts(&model::compose(&w, &cell()).err().unwrap()) }),
        ("share modes", with(wired("first", plain()), wired("second", json!({"modes": {"g.u": "asynchronous"}, "command_lists": start(&["+s 1ms", "+g 1ms"])})), json!({"share": ["g"]}))),
        ("initial", refused(plain(), plain(), json!({"initial": "c"}))),
        ("transitions", refused(plain(), plain(), line("c", "enough", "b"))),
        ("transitions", refused(plain(), plain(), line("a", "enogh", "b"))),
        ("transitions", refused(plain(), plain(), line("a", "enough", "b.back"))),
        ("transitions nothing", refused(own.clone(), plain(), line("a.start", "enough", "b"))),
        ("transitions twice", refused(plain(), plain(), json!({"transitions": [{"from": "a", "condition": "enough", "to": "b"}, {"from": "a", "condition": "enough", "to": "a"}]}))),
        ("unreached", refused(plain(), plain(), json!({"transitions": []}))),
        ("defaults", refused(plain(), json!({"input_parameters": {"limit": {"default": 4.0}}}), plain())),
        ("sorts", refused(plain(), plain(), json!({"rename": {"b.limit": "y", "b.y": "z"}}))),
        ("starved", with(part("first", plain()), reader(json!({})), plain())),
        ("not starved", with(part("first", plain()), { let mut r = reader(json!({"g.u": "asynchronous"})); r["command_lists"] = start(&["+g 1ms"]); r }, plain())),
        ("stores", with(goal("first", "one"), goal("second", "two"), json!({"transitions": [{"from": "a", "condition": "completed", "to": "b"}]}))),
        ("preset stores", with(goal("first", "one"), goal("second", "one"), json!({"preset": {"b.one": 3}, "transitions": [{"from": "a", "condition": "completed", "to": "b"}]}))),
        ("overwritten", with(part("first", plain()), goal("second", "two"), json!({"rename": {"b.u": "y"}}))),
        ("tog writers", refused(plain(), plain(), together(json!({"b.last": "l"})))),
        ("tog outputs", refused(plain(), plain(), together(json!({"b.y": "z"})))),
        ("tog waits", refused(waits.clone(), waits, together(apart.clone()))),
        ("tog priority", refused(json!({"conditions": {"enough": {"priority": 2}}}), plain(), together(apart.clone()))),
        ("tog normal", refused(json!({"conditions": {"enough": {"raises": true}}}), plain(), together(apart.clone()))),
        ("tog tau", refused(own.clone(), own, together(apart.clone()))),
        ("tog shared", refused(plain(), json!({"command_lists": start(&["+s 2ms"])}), json!({"together": true, "transitions": [], "share": ["s"]}))),
    ];
    for (what, text) in all {
        println!("== {what}\n{text}");
    }
}

fn with_gain() -> Value {
    verb(&[("s", "lib.constant")], json!({"name": "second", "command_lists": start(&["+s 1ms"])}))
}
