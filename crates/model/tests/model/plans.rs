// SPDX-License-Identifier: Apache-2.0
//! Checks that correct programs produce exactly the intended plans.
use crate::common::*;
use model::configuration::{Rate, SvvId};
use model::plan::*;
use serde_json::json;

fn plan(verb: serde_json::Value, application: serde_json::Value) -> Plan {
    apply_json(verb, application).unwrap_or_else(|refusals| panic!("refused: {}", texts(&refusals)))
}

fn labels(plan: &Plan, blocks: &[usize]) -> Vec<String> {
    blocks.iter().map(|b| plan.blocks[*b].label.clone()).collect()
}

#[test]
fn the_servo_is_one_activation_in_its_devices_source() {
    let plan = plan(servo(), json!({"owner": "j1"}));
    assert!(plan.blocks.iter().all(|block| block.source == "rtp0.fast"));
    assert_eq!(plan.activations.len(), 1, "{:?}", plan.activations);
    assert_eq!(plan.activations[0].due, Due::Interval);
    assert_eq!(plan.activations[0].rates, [(0, Rate::Interval { period_ns: 1_000_000 }), (0, Rate::Once)]);
    assert_eq!(plan.order, [("rtp0.fast".to_owned(), vec![0, 1, 2])]);
    assert_eq!(plan.blocks[1].drivers, [0]);
    let stage = &plan.lists[0].stages[0];
    assert_eq!(stage.commands, [PlannedCommand::Execute(vec![0]), PlannedCommand::On { activation: 0, every: 1 }, PlannedCommand::Ready]);
    assert_eq!(stage.active, [(0, 1)]);
    assert_eq!(plan.claims, [Claim::Channel { device: "ur5e".into(), channel: 1 }, Claim::Svv { id: SvvId(0), name: "j1.sensed".into() },]);
    let kp = plan.inputs.iter().find(|input| input.name == "kp").unwrap();
    assert_eq!(kp.origin, InputOrigin::DeviceParameter { devices: vec!["j1".into()], parameter: "kp".into() });
    assert_eq!(kp.targets, [Target::Item { block: 1, item: 3 }]);
    assert!(plan.conditions[0].on == [(1, 5)] && !plan.conditions[0].normal);
    assert_eq!(plan.conditions.len(), 1 + 8 + 5);
    assert!(plan.devices.is_empty());
}

#[test]
fn the_move_gathers_its_joints() {
    let plan = plan(movement(), json!({"arguments": {"arm": {"devices": ["j1", "j2"]}}}));
    assert_eq!(plan.blocks.iter().map(|b| b.source.as_str()).collect::<Vec<_>>(), ["rtp0.slow"; 3]);
    assert_eq!(plan.blocks.iter().map(|b| b.size).collect::<Vec<_>>(), [Some(2); 3]);
    let setpoint = &plan.blocks[1].bindings[1];
    let Binding::Cells(cells) = &setpoint.binding else { panic!("{setpoint:?}") };
    let names: Vec<_> = cells.iter().map(|cell| format!("{:?}", plan.cells[*cell].kind)).collect();
    assert!(names[0].contains("j1.commanded") && names[1].contains("j2.commanded"), "{names:?}");
    assert_eq!(plan.activations.len(), 2);
    assert_eq!(labels(&plan, &plan.activations[1].blocks), ["generator", "near"]);
    assert_eq!(plan.lists[0].stages[0].commands, [PlannedCommand::Execute(vec![0]), PlannedCommand::On { activation: 1, every: 1 }]);
    assert_eq!(plan.claims.len(), 4);
    assert_eq!(plan.devices, ["j1", "j2"]);
    assert_eq!(plan.inputs.iter().map(|i| i.type_text.as_str()).collect::<Vec<_>>(), ["double[2]", "double", "double[2]"]);
    assert_eq!(plan.outputs[0].type_text, "double[2]");
    assert!(matches!(&plan.outputs[0].target, Target::Cells(cells) if cells.len() == 2));
    assert_eq!(plan.conditions[0].returns, [0]);
    assert!(plan.conditions[0].normal && !plan.conditions[1].normal);
    assert_eq!(plan.cells.iter().filter(|c| matches!(c.kind, CellKind::Private { .. })).count(), 3);
}

#[test]
fn a_graph_that_is_activated_as_one_is_one_activation() {
    let mut blocks = serde_json::Map::new();
    let mut cells = serde_json::Map::new();
    blocks.insert("b0".into(), json!({"block": {"subroutine": "lib.signal"}}));
    for at in 1..1000 {
        blocks.insert(format!("b{at}"), json!({"block": {"subroutine": "lib.gain"}}));
        cells.insert(format!("c{at}"), json!([format!("b{}.y", at - 1), format!("b{at}.u")]));
    }
    let graph = json!({"name": "chain", "blocks": blocks, "cells": cells, "outputs": {"y": ["b999.y"]}});
    let verb = json!({"name": "v", "blocks": {"g": {"block": {"graph": graph}}}, "command_lists": start(&["+g 1ms"])});
    let plan = plan(verb, json!({}));
    assert_eq!(plan.activations.len(), 1);
    assert_eq!(plan.activations[0].blocks.len(), 1000);
    assert_eq!(plan.order[0].1, (0..1000).collect::<Vec<_>>());
    assert_eq!(plan.blocks[999].label, "g.b999");
}

#[test]
fn placement_follows_interval_pattern_and_driver() {
    let blocks = [("s", "lib.signal"), ("g", "lib.gain"), ("h", "lib.relaxed")];
    let cells = json!({"cells": {"c": ["s.y", "g.u", "h.u"]}, "command_lists": start(&["+s 40ms", "+g", "+h 3ms"])});
    let plan = plan(verb(&blocks, cells.clone()), json!({}));
    assert_eq!(plan.blocks.iter().map(|b| b.source.as_str()).collect::<Vec<_>>(), ["rtp0.slow", "rtp0.slow", "rtp0.fast"]);
    assert_eq!(plan.lists[0].stages[0].active, [(0, 2), (1, 3)]);
    let plan = apply_json(verb(&blocks, cells), json!({"placement": {"s": "rtp0.fast", "g": "rtp0.soft"}})).unwrap();
    assert_eq!(plan.blocks.iter().map(|b| b.source.as_str()).collect::<Vec<_>>(), ["rtp0.fast", "rtp0.soft", "rtp0.fast"]);
    assert_eq!(plan.blocks[1].remote_drivers, [0]);
    assert_eq!(plan.activations[plan.blocks[1].activation].due, Due::Queued { by: vec![] });
}

#[test]
fn a_divided_block_runs_at_its_own_interval() {
    let graph = json!({"name": "g", "blocks": {"s": {"block": {"subroutine": "lib.signal"}}, "e": {"block": {"subroutine": "lib.relaxed"}}},
        "cells": {"c": ["s.y", "e.u"]}, "divide": {"e": 5}});
    let verb = json!({"name": "v", "blocks": {"g": {"block": {"graph": graph}}}, "command_lists": start(&["+g 1ms"])});
    let plan = plan(verb, json!({"every": {"g": 2_000_000}}));
    assert_eq!(plan.lists[0].stages[0].active, [(0, 2), (1, 10)]);
}

#[test]
fn stages_switch_what_changes() {
    let commands = ["+s 1ms", "+h 1ms", "? s.above", "-h", "?"];
    let rest = json!({"cells": {"c": ["s.y", "h.u"]}, "command_lists": start(&commands)});
    let plan = plan(verb(&[("s", "lib.signal"), ("h", "lib.relaxed")], rest), json!({}));
    let stages = &plan.lists[0].stages;
    assert_eq!(stages.len(), 3);
    assert_eq!(stages[0].wait, Some(Wait::Conditions(vec![(0, 2)])));
    assert_eq!(stages[1].commands, [PlannedCommand::Off(1)]);
    assert_eq!(stages[1].wait, Some(Wait::Idle));
    assert_eq!((stages[2].commands.len(), &stages[2].wait, &stages[2].active[..]), (0, &None, &[(0, 1)][..]));
}

#[test]
fn an_instance_outside_drives_a_synchronous_input() {
    let mut cell = cell();
    let writer = json!({"instance": "w#1", "port": "s.y", "source": "rtp0.fast", "mode": "synchronous", "rates": [{"interval": {"period_ns": 2_000_000}}]});
    cell.writers.insert("a".into(), vec![serde_json::from_value(writer).unwrap()]);
    let rest = json!({"instantiation_parameters": {"x": ["g.u"]}, "command_lists": start(&["+g"])});
    let plan = apply_in(cell, verb(&[("g", "lib.gain")], rest), json!({"arguments": {"x": {"svv": "a"}}})).unwrap();
    assert_eq!(plan.blocks[0].external_drivers, [(0, "a".to_owned())]);
    assert_eq!(plan.blocks[0].source, "rtp0.fast");
    assert_eq!(plan.activations[0].due, Due::Queued { by: vec![] });
    assert_eq!(plan.activations[0].rates, [(0, Rate::Interval { period_ns: 2_000_000 })]);
}

#[test]
fn an_edge_against_the_order_is_a_remark() {
    let rest = json!({"cells": {"c": ["a.y", "b.u"], "d": ["b.y", "a.u"]}, "command_lists": start(&["+a 1ms", "+b 1ms"])});
    let plan = plan(verb(&[("a", "lib.relaxed"), ("b", "lib.relaxed")], rest), json!({}));
    assert_eq!(plan.order[0].1, [0, 1]);
    assert!(plan.remarks.iter().any(|r| r.text == "'a' reads 'b' as the previous firing left it: a delay of one firing of 'rtp0.fast'"), "{:?}", plan.remarks);
}

#[test]
fn what_is_left_out_is_filled() {
    let plan = plan(verb(&[("k", "lib.constant")], json!({"command_lists": start(&["+k 1ms"])})), json!({}));
    let constant = plan.cells.iter().find(|c| matches!(c.kind, CellKind::Constant { .. })).unwrap();
    assert_eq!(constant.initial, 2.5_f64.to_le_bytes());
    assert_eq!(plan.remarks.len(), 2);
}

#[test]
fn ratio_ports_drive_slower_blocks() {
    let rest = json!({"cells": {"c": ["s.y", "g.u"]}, "command_lists": start(&["+s 1ms", "+g"])});
    let plan = plan(verb(&[("s", "lib.slow_out"), ("g", "lib.gain")], rest), json!({}));
    assert_eq!(plan.activations[1].due, Due::Driven { by: vec![(0, 4)] });
    assert_eq!(plan.activations[1].rates, [(0, Rate::Interval { period_ns: 4_000_000 })]);
}

#[test]
fn lists_take_turns_in_writing_one_svv() {
    let lists = json!({"one": list(&["+s 1ms", "+g"]), "two": list(&["+r 2ms"])});
    let rest = json!({"instantiation_parameters": {"x": ["s.y", "r.y", "g.u"]}, "command_lists": {"start": null}, "initial": "one",
        "transitions": [{"from": "one", "condition": "fault", "to": "two"}]});
    let mut program = verb(&[("s", "lib.signal"), ("r", "lib.signal"), ("g", "lib.gain")], rest);
    program["command_lists"] = lists;
    let plan = plan(program, json!({"arguments": {"x": {"svv": "a"}}}));
    assert_eq!(plan.claims.len(), 1);
    assert_eq!(plan.blocks[2].drivers, [0], "only the writer that is on together with it drives it");
    assert_eq!((plan.blocks[0].activation, plan.blocks[1].activation, plan.blocks[2].activation), (0, 1, 0));
    let fault = plan.conditions.iter().position(|c| c.name == "fault").unwrap();
    assert_eq!((plan.initial, &plan.lists[0].transitions[..]), (0, &[(fault, 1)][..]));
    assert_eq!(plan.lists[1].stages[0].commands, [PlannedCommand::On { activation: 1, every: 2 }]);
}

#[test]
fn a_graphs_inner_items_are_reached_by_their_labels() {
    let graph = json!({"name": "loop", "blocks": {"pid": {"block": {"subroutine": "lib.pid"}}, "read": {"block": {"subroutine": "lib.read_channel"}}},
        "inputs": {"setpoint": ["pid.setpoint"]}, "outputs": {"effort": ["pid.effort"]}, "cells": {"m": ["read.y", "pid.measured"]}, "modes": {"setpoint": "asynchronous"}});
    let rest = json!({"name": "v", "blocks": {"servo": {"block": {"graph": graph}, "constants": {"pid.limit": "2 N.m"}}},
        "instantiation_parameters": {"x": ["servo.read.channel"]}, "input_parameters": {"kp": {"targets": ["servo.pid.kp"]}, "to": {"targets": ["servo.setpoint"], "default": "90 deg"}},
        "output_values": {"q": "servo.pid.measured", "e": "servo.effort"}, "command_lists": start(&["!servo", "+servo 1ms"]), "conditions": {"f": {"on": ["servo.pid.following_error"]}}});
    let plan = plan(rest, json!({"arguments": {"x": {"channel": {"device": "ur5e", "channel": "j1.position"}}}}));
    assert_eq!(plan.blocks[0].values, [(4, 2.0_f64.to_le_bytes().to_vec())]);
    assert_eq!(plan.lists[0].stages[0].commands, [PlannedCommand::Execute(vec![1, 0]), PlannedCommand::On { activation: 0, every: 1 }]);
    assert_eq!(plan.conditions[0].on, [(0, 5)]);
    assert_eq!(plan.inputs[1].unit, "rad");
    assert!(matches!(plan.outputs[0].target, Target::Cell(_)) && matches!(plan.inputs[1].targets[..], [Target::Cell(_)]));
}

#[test]
fn an_instance_tells_what_it_writes() {
    let mut cell = cell();
    let plan = plan(servo(), json!({"owner": "j1"}));
    let writers = plan.writers("joint_servo#1", &cell);
    assert_eq!(writers.len(), 1);
    let (svv, writer) = &writers[0];
    assert_eq!((svv.as_str(), writer.port.as_str(), writer.source.as_str()), ("j1.sensed", "read.y", "rtp0.fast"));
    assert_eq!(writer.rates, [Rate::Interval { period_ns: 1_000_000 }, Rate::Once]);
    cell.writers.insert(svv.clone(), vec![writer.clone()]);
    let rest = json!({"instantiation_parameters": {"x": ["g.u"]}, "command_lists": start(&["+g"])});
    let reader = apply_in(cell, verb(&[("g", "lib.gain")], rest), json!({"arguments": {"x": {"svv": "j1.sensed"}}})).unwrap();
    assert_eq!(reader.activations[0].rates, [(0, Rate::Interval { period_ns: 1_000_000 })]);
}

#[test]
fn a_trigger_takes_no_interval() {
    let rest = json!({"command_lists": start(&["+s"])});
    let plan = plan(verb(&[("s", "lib.signal")], rest), json!({}));
    assert_eq!(plan.blocks[0].source, "rtp0.door");
    assert_eq!(plan.activations[0].rates, [(0, Rate::Trigger { source: "rtp0.door".into(), every: 1 })]);
}
