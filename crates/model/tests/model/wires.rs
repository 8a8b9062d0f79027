// SPDX-License-Identifier: Apache-2.0
//! Definitions while they are drawn: the place of each refusal, and the possible wires.
use crate::common::*;
use model::refusal::Refusal;
use model::{Drawing, PortName, check_drawing, compatible, compatible_with};
use serde_json::{Value, json};

fn drawing(of: Value) -> Drawing {
    serde_json::from_value(of).expect("a drawing")
}

/// Returns `class: where` of each finding.
fn findings(of: Value) -> Vec<String> {
    let found = check_drawing(&drawing(of), &cell()).expect("it is a definition");
    found.iter().map(|refusal| format!("{:?}: {}", refusal.class, serde_json::to_string(&refusal.about).expect("JSON"))).collect()
}

fn port(name: &str) -> PortName {
    let (block, port) = name.rsplit_once('.').unwrap_or(("", name));
    PortName { block: block.into(), port: port.into() }
}

fn why(of: &Value, from: &str, to: &str) -> Option<String> {
    let there = compatible(&drawing(of.clone()), &cell(), &port(from), &port(to)).expect("both are there");
    let back = compatible(&drawing(of.clone()), &cell(), &port(to), &port(from)).expect("both are there");
    assert_eq!(there, back, "which end is named first does not matter");
    there
}

fn sketch() -> Value {
    json!({"graph": {"name": "g", "blocks": {
        "s": "lib.signal", "t": "lib.signal", "g": "lib.gain", "h": "lib.gain", "n": "lib.narrow", "v": "lib.vector", "p": "lib.pid",
        "plan": "lib.planner", "gen": "lib.generator", "near": "lib.near", "r": "lib.relaxed",
        "inner": {"graph": {"name": "inner", "blocks": {"k": "lib.gain"}, "inputs": {"u": "k.u"}, "outputs": {"y": "k.y"}}}},
        "inputs": {"in": "h.u"}, "outputs": {"out": "h.y"}, "cells": {"c": ["s.y", "g.u"]}}})
}

/// Returns the sketch with the nested graph in the long form.
fn whole() -> Value {
    let mut of = sketch();
    let inner = of["graph"]["blocks"]["inner"].clone();
    of["graph"]["blocks"]["inner"] = json!({"block": inner});
    of
}

#[test]
fn a_wire_goes_or_the_reason_is_said() {
    let of = whole();
    assert_eq!(why(&of, "s.y", "g.u"), None, "it is there already");
    assert_eq!(why(&of, "s.y", "r.u"), None);
    assert_eq!(why(&of, "g.y", "inner.u"), None);
    assert_eq!(why(&of, "inner.y", "r.u"), None);
    assert_eq!(why(&of, "in", "r.u"), None);
    assert_eq!(
        why(&of, "g.y", "n.u").as_deref(),
        Some("cannot bind output 'g.y' (double) to input 'n.u' (float): types differ; declare one of them as the other")
    );
    assert_eq!(
        why(&of, "p.effort", "p.setpoint").as_deref(),
        Some(
            "cannot bind output 'p.effort' (double, N.m) to input 'p.setpoint' (double, rad): units differ; declare one of them as the other, or convert with a gain that has a unit, for example k='2 N.m/rad'"
        )
    );
    let both = compatible(&drawing(of.clone()), &cell(), &port("s.y"), &port("t.y")).expect("there");
    assert_eq!(both.as_deref(), Some("cannot bind output 's.y' (double) to output 't.y' (double): both write"));
    assert!(compatible(&drawing(of.clone()), &cell(), &port("g.u"), &port("r.u")).expect("there").is_some_and(|why| why.ends_with("neither of them writes")));
    assert_eq!(why(&of, "t.y", "g.u").as_deref(), Some("'c' has two writers: output 's.y' (double) and output 't.y' (double); give each its own cell"));
    assert_eq!(why(&of, "g.y", "g.u").as_deref(), Some("'c' has two writers: output 's.y' (double) and output 'g.y' (double); give each its own cell"));
    assert_eq!(why(&of, "v.y", "near.goal"), None, "a size that is not known yet takes any");
    assert!(why(&of, "v.y", "r.u").is_some_and(|why| why.contains("types differ")));
    assert!(why(&of, "inner.y", "inner.u").is_some_and(|why| why.contains("form a cycle: 'inner.k' → 'inner.k'")));
    assert_eq!(why(&of, "h.y", "r.u"), None, "what leaves the graph may be read inside");
    assert!(why(&of, "in", "g.u").is_some_and(|why| why.contains("a port has only one binding")));
}

#[test]
fn a_wire_of_a_verb_that_reads_a_channel_is_none() {
    let of = json!({"verb": {"name": "v", "blocks": {"read": "lib.read_channel", "s": "lib.signal", "p": "lib.pid"}, "command_lists": {"start": []}}});
    assert!(why(&of, "s.y", "read.channel").is_some_and(|why| why.contains("a device item takes a channel")));
    assert_eq!(why(&of, "read.y", "p.measured"), None, "a unit that is not known agrees with all");
}

#[test]
fn all_ports_are_judged_as_each_is() {
    let of = whole();
    let verdicts = compatible_with(&drawing(of.clone()), &cell(), &port("g.y")).expect("it is there");
    assert!(verdicts.len() > 20 && verdicts.iter().any(|verdict| verdict.block.is_empty() && verdict.port == "out"));
    for verdict in verdicts {
        let name = format!("{}.{}", verdict.block, verdict.port);
        let alone = compatible(&drawing(of.clone()), &cell(), &port("g.y"), &port(name.trim_start_matches('.'))).expect("both are there");
        assert_eq!(verdict.reason, alone, "{name}");
    }
}

#[test]
fn a_port_that_is_not_there_and_a_drawing_of_nothing_are_refused() {
    let refused = compatible(&drawing(whole()), &cell(), &port("g.z"), &port("r.u")).expect_err("no such port");
    assert_eq!(texts(&refused), "UnknownName: block 'g' has no port 'z'; there are u, y");
    let refused = compatible(&drawing(whole()), &cell(), &port("gg.y"), &port("r.u")).expect_err("no such block");
    assert!(texts(&refused).starts_with("UnknownName: there is no block 'gg'"));
    assert!(check_drawing(&drawing(json!({})), &cell()).is_err());
}

#[test]
fn findings_point_at_ports_boxes_and_wires() {
    assert_eq!(
        findings(json!({"graph": {"name": "g", "blocks": {"s": "lib.signal", "n": "lib.narrow"}, "cells": {"c": ["s.y", "n.u"]}}})),
        [r#"TypeMismatch: [{"block":"n","port":"u"},{"block":"s","port":"y"}]"#]
    );
    assert_eq!(
        findings(json!({"graph": {"name": "g", "blocks": {"s": "lib.signal", "x": "lib.gian"}, "cells": {"c": ["s.y", "s.why"]}}})),
        [r#"UnknownName: [{"block":"x"}]"#, r#"UnknownName: [{"cell":"c"}]"#]
    );
    assert_eq!(
        findings(json!({"graph": {"name": "g", "blocks": {"a": "lib.gain", "b": "lib.gain"}, "cells": {"c": ["a.y", "b.u"], "d": ["b.y", "a.u"]}}})),
        [r#"SynchronousCycle: [{"block":"a"},{"block":"b"}]"#]
    );
    assert_eq!(
        findings(json!({"graph": {"name": "g", "blocks": {"a": {"block": "lib.gain", "constants": {"kk": 1}}}, "inputs": {"u": "a.u"}}})),
        [r#"UnknownName: [{"block":"a"}]"#]
    );
    assert_eq!(findings(json!({"graph": {"name": "g", "blocks": {"a": "lib.gain"}}})), [r#"CoverError: [{"block":"a","port":"u"}]"#]);
}

#[test]
fn findings_point_at_lists_commands_conditions_and_transitions() {
    let mut of = json!({"name": "v", "blocks": {"s": "lib.signal"}, "initial": "start",
        "command_lists": {"start": [{"activate": "s", "every": "1 ms"}, {"execute": "q"}], "lost": []},
        "conditions": {"high": "s.above", "low": {"on": "s.below"}},
        "transitions": [{"from": "start", "condition": "high", "to": "strat"}]});
    assert_eq!(
        findings(json!({"verb": of.clone()})),
        [r#"UnknownName: [{"list":"start","command":1}]"#, r#"UnknownName: [{"condition":"low"}]"#, r#"UnknownName: [{"transition":["start","high"]}]"#]
    );
    of["command_lists"]["start"] = json!([{"activate": "s", "every": "1 ms"}]);
    of["conditions"] = json!({"high": "s.above"});
    of["transitions"] = json!([]);
    assert_eq!(findings(json!({"verb": of.clone()})), [r#"DefinitionError: [{"list":"lost"}]"#]);
    of["input_parameters"] = json!({"level": "s.levle"});
    of["output_values"] = json!({"y": "s.why"});
    let found = findings(json!({"verb": of}));
    assert_eq!(found, [r#"UnknownName: [{"parameter":"level"}]"#, r#"UnknownName: [{"output":"y"}]"#]);
}

/// Returns `class: message: where` of each finding.
fn told(of: Value) -> Vec<String> {
    let found = check_drawing(&drawing(of), &cell()).expect("it is a definition");
    let parts = |refusal: &Refusal| serde_json::to_string(&refusal.about).expect("JSON");
    found.iter().map(|refusal| format!("{:?}: {}: {}", refusal.class, refusal.message, parts(refusal))).collect()
}

#[test]
fn members_of_objects_have_the_units_and_types_of_their_device_type() {
    let verb = |port: &str, each: bool| {
        json!({"verb": {"name": "v", "blocks": {"w": "lib.write_channel", "p": "lib.pid", "n": "lib.narrow", "plan": "lib.planner", "q": "lib.vector", "s": "lib.signal"},
            "objects": {"arm": {"device_type": "Joint", "each": each}}, "instantiation_parameters": {"arm.commanded": [port], "drive": ["w.channel"]},
            "command_lists": {"start": [{"activate": "s", "every": "1 ms"}]}}})
    };
    let of = |port: &str, each: bool| told(verb(port, each)).into_iter().filter(|line| line.contains("arm.commanded")).collect::<Vec<_>>();
    assert_eq!(of("p.setpoint", false), Vec::<String>::new());
    assert_eq!(of("plan.start", true), Vec::<String>::new());
    assert_eq!(of("q.q", true), Vec::<String>::new());
    assert_eq!(of("q.y", true), Vec::<String>::new(), "each writes its own");
    assert_eq!(
        of("p.effort", false),
        [
            r#"UnitMismatch: cannot bind SVV 'arm.commanded' (double, rad) to output 'p.effort' (double, N.m): units differ: [{"block":"p","port":"effort"},{"cell":"arm.commanded"}]"#
        ]
    );
    assert_eq!(
        of("n.u", false),
        [
            r#"TypeMismatch: cannot bind SVV 'arm.commanded' (double, rad) to input 'n.u' (float): types differ: [{"block":"n","port":"u"},{"cell":"arm.commanded"}]"#
        ]
    );
    assert!(of("q.q", false)[0].starts_with("TypeMismatch: cannot bind SVV 'arm.commanded' (double, rad) to input 'q.q' (double[6], rad)"));
}

#[test]
fn two_writers_in_a_list_are_found_where_they_are_active_together() {
    let mut of = json!({"name": "v", "blocks": {"s": "lib.signal", "t": "lib.signal", "r": "lib.relaxed"}, "cells": {"c": ["s.y", "t.y", "r.u"]},
        "command_lists": {"start": [{"activate": "s", "every": "1 ms"}, {"activate": "t", "every": "1 ms"}, {"activate": "r", "every": "1 ms"}]}});
    assert_eq!(
        told(json!({"verb": of.clone()})),
        [
            r#"SecondWriter: cell 'c' has two active writers in command list 'start': output 's.y' (double) and output 't.y' (double): [{"block":"t","port":"y"},{"block":"s","port":"y"},{"list":"start"}]"#
        ]
    );
    of["command_lists"]["start"] = json!([{"activate": "s", "every": "1 ms"}, {"wait": "1 s"}, {"deactivate": "s"}, {"activate": "t", "every": "1 ms"}, {"activate": "r", "every": "1 ms"}]);
    assert_eq!(told(json!({"verb": of})), Vec::<String>::new());
    assert_eq!(
        told(json!({"graph": {"name": "g", "blocks": {"s": "lib.signal", "t": "lib.signal", "r": "lib.relaxed"}, "cells": {"c": ["s.y", "t.y", "r.u"]}}})),
        [
            r#"SecondWriter: 'c' has two writers: output 's.y' (double) and output 't.y' (double): [{"block":"t","port":"y"},{"block":"s","port":"y"},{"cell":"c"}]"#
        ]
    );
}

#[test]
fn constants_with_units_are_judged_by_the_unit_of_what_they_are_for() {
    let of = |frequency: Value| json!({"graph": {"name": "g", "blocks": {"s": {"block": "lib.signal", "constants": {"frequency": frequency}}}}});
    assert_eq!(told(of(json!("3 Hz"))), Vec::<String>::new());
    assert_eq!(
        told(of(json!("3 rad"))),
        [
            r#"UnitMismatch: the constant for parameter 's.frequency' (double, Hz): cannot convert '3 rad' to Hz: the dimensions differ: [{"block":"s","port":"frequency"}]"#
        ]
    );
    // Known only from its neighbour.
    let through = json!({"graph": {"name": "g", "blocks": {"p": "lib.pid", "g": {"block": "lib.gain", "constants": {"k": "3 Hz"}}}, "cells": {"c": ["p.effort", "g.u"], "d": ["g.y", "p.measured"]},
        "inputs": {"setpoint": "p.setpoint"}, "modes": {"p.measured": "asynchronous"}}});
    assert!(told(through)[0].starts_with("UnitMismatch: cannot bind output 'g.y' (double, "));
}

#[test]
fn an_input_parameter_is_judged_by_what_it_goes_to() {
    let of = |input: Value| {
        json!({"verb": {"name": "v", "blocks": {"s": "lib.signal", "n": "lib.narrow"}, "modes": {"n.u": "asynchronous"}, "cells": {"c": ["n.u"]}, "input_parameters": {"speed": input},
            "command_lists": {"start": [{"activate": "s", "every": "1 ms"}]}}})
    };
    assert_eq!(told(of(json!({"targets": "s.frequency", "default": "2 Hz"}))), Vec::<String>::new());
    assert_eq!(
        told(of(json!({"targets": "s.frequency", "default": "2 rad"}))),
        [r#"UnitMismatch: the default of the input parameter 'speed': cannot convert '2 rad' to Hz: the dimensions differ: [{"parameter":"speed"}]"#]
    );
    assert_eq!(
        told(of(json!({"targets": ["s.frequency", "n.u"]}))),
        [
            r#"TypeMismatch: the input parameter 'speed' goes to parameter 's.frequency' (double, Hz) and to input 'n.u' (float): types differ: [{"parameter":"speed"}]"#
        ]
    );
}

#[test]
fn an_input_that_nothing_drives_is_found_where_nothing_outside_can() {
    let mut of = json!({"name": "v", "blocks": {"s": "lib.signal", "t": "lib.signal", "m": "lib.sum"}, "cells": {"a": ["s.y", "m.a"], "b": ["t.y", "m.b"]},
        "command_lists": {"start": [{"activate": "s", "every": "1 ms"}, {"activate": "t", "every": "2 ms"}, {"activate": "m"}]}});
    let found = told(json!({"verb": of.clone()}));
    assert!(found[0].starts_with("SchedulingError: input 'm.a' (double) is driven every 1 ms, but input 'm.b' (double) every 2 ms"), "{found:?}");
    of["command_lists"]["start"] = json!([{"activate": "s", "every": "1 ms"}, {"activate": "m"}]);
    let found = told(json!({"verb": of.clone()}));
    assert!(found[0].ends_with(r#"[{"block":"m","port":"b"},{"list":"start"}]"#), "{found:?}");
    of["cells"] = json!({"a": ["s.y", "m.a"]});
    of["instantiation_parameters"] = json!({"level": ["m.b"]});
    assert_eq!(told(json!({"verb": of})), Vec::<String>::new(), "who writes it is known with the SVV");
}

#[test]
fn the_verbs_of_the_cell_have_no_findings() {
    assert_eq!(findings(json!({"verb": servo()})), Vec::<String>::new());
    assert_eq!(findings(json!({"verb": movement()})), Vec::<String>::new());
}

#[test]
fn of_very_many_mistakes_the_first_are_looked_at_for_what_was_meant() {
    let blocks: serde_json::Map<String, Value> = (0..300).map(|number| (format!("gain{number}"), json!("lib.gain"))).collect();
    let cells: serde_json::Map<String, Value> = (0..300).map(|number| (format!("c{number}"), json!([format!("gian{number}.u")]))).collect();
    let found = check_drawing(&drawing(json!({ "graph": { "name": "g", "blocks": blocks, "cells": cells } })), &cell()).expect("it is a definition");
    let missing: Vec<_> = found.iter().filter(|refusal| refusal.message.contains("gian")).collect();
    assert_eq!(missing.len(), 300, "each is told");
    assert!(missing[0].remedy.starts_with("did you mean 'gain"), "{:?}", missing[0]);
    assert_eq!(missing[299].remedy, "");
}
