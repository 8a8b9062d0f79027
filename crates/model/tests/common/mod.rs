// SPDX-License-Identifier: Apache-2.0
//! A small cell to apply verbs to: one RTP, an arm of two joints, a handful of blocks; definitions as JSON.
#![allow(dead_code)]
use model::configuration::{Configuration, SvvId};
use model::definition::{Application, Graph, Verb};
use model::interface::{Interface, Item, Kind, Mode};
use model::plan::Plan;
use model::refusal::Refusals;
use serde_json::{Value, json};

/// Returns an interface from lines `kind type name [unit] [default] [sized] [ratio=n] [history=n] [async]`.
pub fn interface(name: &str, lines: &[&str]) -> Interface {
    let items = lines.iter().map(|line| item(line)).collect();
    Interface { name: name.into(), doc: String::new(), items, types: Default::default(), file: String::new(), line: 0 }
}

fn item(line: &str) -> Item {
    let words: Vec<&str> = line.split_whitespace().collect();
    let kind = match words[0] {
        "in" => Kind::Input,
        "out" => Kind::Output,
        "read" => Kind::DeviceRead,
        "write" => Kind::DeviceWrite,
        "param" => Kind::Parameter,
        "condition" => Kind::Condition,
        "size" => Kind::Size,
        _ => Kind::State,
    };
    let rest = &words[3.min(words.len())..];
    let has = |flag: &str| rest.contains(&flag);
    let ratio = rest.iter().find_map(|word| word.strip_prefix("ratio=")?.parse().ok());
    let history = rest.iter().find_map(|word| word.strip_prefix("history=")?.parse().ok()).unwrap_or(0);
    let is_flag = |word: &&&str| ["default", "sized", "async"].contains(*word) || word.starts_with("ratio=") || word.starts_with("history=");
    let (unit, unit_of, range) = Item::declared_unit(rest.iter().find(|word| !is_flag(word)).map_or("", |unit| *unit));
    Item {
        name: words[2].into(),
        kind,
        mode: ratio.map_or(if has("async") { Mode::Asynchronous } else { Mode::Synchronous }, Mode::Ratio),
        type_text: if words[1] == "-" { String::new() } else { words[1].into() },
        unit,
        unit_of,
        range,
        doc: String::new(),
        has_default: has("default"),
        nonfinite: false,
        sized: has("sized"),
        history,
        default: if has("default") { 2.5_f64.to_le_bytes().to_vec() } else { Vec::new() },
        least: 1,
        most: 8,
    }
}

pub fn cell() -> Configuration {
    let mut cell: Configuration = serde_json::from_value(json!({
        "processors": ["rtp0"],
        "sources": {
            "rtp0.fast": {"processor": "rtp0", "kind": {"timer": {"period_ns": 1_000_000}}, "priority": 80},
            "rtp0.slow": {"processor": "rtp0", "kind": {"timer": {"period_ns": 20_000_000}}, "priority": 60},
            "rtp0.door": {"processor": "rtp0", "kind": "trigger", "priority": 70},
            "rtp0.soft": {"processor": "rtp0", "kind": "software", "priority": 50}},
        "devices": {"ur5e": {"processor": "rtp0", "source": "rtp0.fast", "channels": [
            {"name": "j1.position", "write": false, "type_text": "double", "unit": "rad"},
            {"name": "j1.effort", "write": true, "type_text": "double", "unit": "N.m"},
            {"name": "j2.position", "write": false, "type_text": "double", "unit": "rad"},
            {"name": "j2.effort", "write": true, "type_text": "double", "unit": "N.m"},
            {"name": "mass", "write": false, "type_text": "float", "unit": "kg"}]}},
        "interfaces": {}, "verbs": {},
        "device_types": {"Joint": {"name": "Joint", "verb": "joint_servo",
            "svvs": {"sensed": {"type_text": "double", "unit": "rad"}, "commanded": {"type_text": "double", "unit": "rad"},
                     "goal": {"type_text": "double", "unit": "rad"}},
            "parameters": {"max_speed": {"default": 3.0, "unit": "rad/s"}, "kp": {"default": 80.0, "tunable": true},
                           "max_effort": {"default": 150.0, "unit": "N.m"}}},
            "Gripper": {"name": "Gripper"}},
        "svvs": {}, "logical_devices": {}, "writers": {}, "placement": {}
    }))
    .expect("the cell is well formed");
    for joint in ["j1", "j2"] {
        let mut svvs = serde_json::Map::new();
        for member in ["sensed", "commanded", "goal"] {
            svvs.insert(member.into(), json!(format!("{joint}.{member}")));
            let id = cell.svvs.len() as u32;
            let svv = json!({"id": id, "type_text": "double", "unit": "rad", "device": joint});
            cell.svvs.insert(format!("{joint}.{member}"), serde_json::from_value(svv).expect("an SVV"));
        }
        cell.logical_devices.insert(
            joint.into(),
            serde_json::from_value(json!({
            "device_type": "Joint", "svvs": svvs, "parameters": {}, "enabled": true, "source": "rtp0.fast",
            "arguments": {"drive": {"part": {"device": "ur5e", "part": joint}}}}))
            .expect("a device"),
        );
    }
    for (name, type_text, unit) in [("a", "double", ""), ("b", "double", ""), ("f", "float", ""), ("q", "double[6]", "rad"), ("speed", "double", "rad/s")] {
        let id = SvvId(100 + cell.svvs.len() as u32);
        let svv = json!({"id": id, "type_text": type_text, "unit": unit});
        cell.svvs.insert(name.into(), serde_json::from_value(svv).expect("an SVV"));
    }
    for interface in blocks() {
        cell.interfaces.insert(interface.name.clone(), interface);
    }
    for verb in [servo(), movement()] {
        let verb: Verb = serde_json::from_value(verb).expect("a verb");
        cell.verbs.insert(verb.name.clone(), verb);
    }
    cell
}

fn blocks() -> Vec<Interface> {
    vec![
        interface("lib.read_channel", &["read double channel", "out double y"]),
        interface("lib.write_channel", &["in double u", "write double channel"]),
        interface(
            "lib.pid",
            &[
                "in double measured rad",
                "in double setpoint rad",
                "out double effort N.m",
                "param double kp",
                "param double limit N.m",
                "condition - following_error",
            ],
        ),
        interface(
            "lib.planner",
            &[
                "size uint32_t n",
                "in double[n] start rad async sized",
                "out double[n] target rad sized",
                "in double[n] goal rad async sized",
                "in double speed rad/s async",
                "param double[n] speed_max rad/s sized",
                "out double[16] coefficients",
            ],
        ),
        interface("lib.generator", &["size uint32_t n", "in double[16] coefficients async", "out double[n] setpoint rad sized"]),
        interface("lib.near", &["size uint32_t n", "in double[n] goal rad async sized", "in double[n] sensed rad async sized", "condition - done"]),
        interface("lib.gain", &["in double u", "out double y =k.u", "param double k"]),
        interface("lib.sum", &["in double a", "in double b", "out double y"]),
        interface("lib.relaxed", &["in double u async", "out double y"]),
        interface("lib.signal", &["out double y", "param double frequency Hz", "condition double above"]),
        interface("lib.narrow", &["in float u", "out float y"]),
        interface("lib.constant", &["in double u default", "out double y"]),
        interface("lib.slow_out", &["out double y ratio=4"]),
        interface("lib.slow_in", &["in double u ratio=4", "out double y"]),
        interface("lib.vector", &["in double[6] q rad async", "out double[6] y rad"]),
        interface("lib.odd", &["in doubel u"]),
    ]
}

/// Returns the servo of DESIGN 4.1.
pub fn servo() -> Value {
    json!({"name": "joint_servo",
        "blocks": {"read": {"block": {"subroutine": "lib.read_channel"}}, "pid": {"block": {"subroutine": "lib.pid"}},
                   "write": {"block": {"subroutine": "lib.write_channel"}}},
        "instantiation_parameters": {"drive.position": ["read.channel"], "drive.effort": ["write.channel"],
                                     "sensed": ["read.y", "pid.measured"], "commanded": ["pid.setpoint"]},
        "cells": {"effort": ["pid.effort", "write.u"]},
        "input_parameters": {"kp": {"targets": ["pid.kp"], "tunable": true}, "max_effort": {"targets": ["pid.limit"]}},
        "modes": {"pid.setpoint": "asynchronous"},
        "command_lists": {"start": {"commands": [{"command": "execute", "block": "read"},
            {"command": "activate", "block": "read", "every_ns": 1_000_000}, {"command": "activate", "block": "pid"},
            {"command": "activate", "block": "write"}, {"command": "ready"}]}},
        "conditions": {"following_error": {"on": ["pid.following_error"], "raises": true}}})
}

/// Returns the move of DESIGN 4.1.
pub fn movement() -> Value {
    json!({"name": "move",
        "blocks": {"planner": {"block": {"subroutine": "lib.planner"}}, "generator": {"block": {"subroutine": "lib.generator"}},
                   "near": {"block": {"subroutine": "lib.near"}}},
        "objects": {"arm": {"device_type": "Joint", "each": true}},
        "instantiation_parameters": {"arm.commanded": ["planner.start", "generator.setpoint"],
            "arm.goal": ["planner.target", "near.goal"], "arm.sensed": ["near.sensed"]},
        "cells": {"coefficients": ["planner.coefficients", "generator.coefficients"]},
        "input_parameters": {"goal": {"targets": ["planner.goal"]}, "speed": {"targets": ["planner.speed"], "default": 0.5},
                             "arm.max_speed": {"targets": ["planner.speed_max"]}},
        "output_values": {"position": "near.sensed"},
        "command_lists": {"start": {"commands": [{"command": "execute", "block": "planner"},
            {"command": "activate", "block": "generator", "every_ns": 20_000_000},
            {"command": "activate", "block": "near", "every_ns": 20_000_000}]}},
        "conditions": {"arrived": {"on": ["near.done"], "returns": ["position"]}, "time_limit": {"raises": true}}})
}

/// Returns a verb with blocks `label: module.block` and the remaining members.
pub fn verb(blocks: &[(&str, &str)], rest: Value) -> Value {
    let uses: serde_json::Map<String, Value> =
        blocks.iter().map(|(label, name)| ((*label).into(), json!({"block": {"subroutine": name}, "place": {"file": "p.py", "line": 7}}))).collect();
    let mut verb = json!({"name": "v", "blocks": uses, "command_lists": {"start": {"commands": []}}, "place": {"file": "p.py", "line": 3}});
    merge(&mut verb, rest);
    verb
}

pub fn merge(base: &mut Value, over: Value) {
    match (base, over) {
        (Value::Object(base), Value::Object(over)) => {
            for (key, value) in over {
                merge(base.entry(key).or_insert(Value::Null), value);
            }
        }
        (base, over) => *base = over,
    }
}

/// Returns one command list of commands in short form: `+label`, `+label 1ms`, `-label`, `!label`, `?` (wait), `? label.condition`.
pub fn start(commands: &[&str]) -> Value {
    json!({"start": list(commands)})
}

pub fn list(commands: &[&str]) -> Value {
    let commands: Vec<Value> = commands
        .iter()
        .map(|text| {
            let (sign, rest) = text.split_at(1);
            let mut words = rest.split_whitespace();
            let label = words.next();
            let every = words.next().map(|every| model::quantity::duration_ns(every, "it").expect("a duration"));
            match sign {
                "+" => json!({"command": "activate", "block": label, "every_ns": every}),
                "-" => json!({"command": "deactivate", "block": label}),
                "!" => json!({"command": "execute", "block": label}),
                "*" => json!({"command": "install", "blocks": [label]}),
                _ => json!({"command": "wait", "conditions": label.into_iter().collect::<Vec<_>>()}),
            }
        })
        .collect();
    json!({"commands": commands})
}

pub fn apply_json(verb: Value, application: Value) -> Result<Plan, Refusals> {
    apply_in(cell(), verb, application)
}

pub fn apply_in(mut cell: Configuration, verb: Value, application: Value) -> Result<Plan, Refusals> {
    let verb: Verb = serde_json::from_value(verb).expect("a verb");
    let mut whole = json!({"verb": verb.name});
    merge(&mut whole, application);
    let application: Application = serde_json::from_value(whole).expect("an application");
    cell.verbs.insert(verb.name.clone(), verb);
    let planned = model::apply(&application, &cell);
    if planned.is_ok() {
        let drawing = model::Drawing { graph: None, verb: cell.verbs.get(&application.verb).cloned() };
        assert_eq!(model::check_drawing(&drawing, &cell), Ok(Vec::new()), "what can be applied has no findings");
    }
    planned
}

pub fn check_graph_json(graph: Value) -> Refusals {
    let graph: Graph = serde_json::from_value(graph).expect("a graph");
    model::check_graph(&graph, &cell())
}

/// Formats refusals as `class: message; remedy at place`, one per line.
pub fn texts(refusals: &Refusals) -> String {
    refusals.iter().map(|r| format!("{:?}: {r}", r.class)).collect::<Vec<_>>().join("\n")
}
