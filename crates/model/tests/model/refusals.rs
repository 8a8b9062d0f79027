// SPDX-License-Identifier: Apache-2.0
//! One minimal program for each kind of refusal, and its message.
mod calls;

use crate::common::*;
use serde_json::{Value, json};

/// Checks that the program is refused with exactly this refusal.
fn check(program: (Value, Value), expected: &str) {
    let refusals = apply_json(program.0, program.1).map(|_| ()).expect_err("the program is accepted");
    let found = texts(&refusals).replace(" at p.py:7", "").replace(" at p.py:3", "");
    assert_eq!(found, expected);
}

fn graph_check(graph: Value, expected: &str) {
    assert_eq!(texts(&check_graph_json(graph)), expected);
}

fn v(blocks: &[(&str, &str)], rest: Value) -> (Value, Value) {
    (verb(blocks, rest), json!({}))
}

fn with(base: Value, over: Value, application: Value) -> (Value, Value) {
    let mut whole = base;
    merge(&mut whole, over);
    (whole, application)
}

fn two(over: Value) -> (Value, Value) {
    v(&[("s", "lib.signal"), ("g", "lib.gain")], with(json!({"cells": {"c": ["s.y", "g.u"]}, "command_lists": start(&["+s 1ms", "+g"])}), over, json!(null)).0)
}

fn arm() -> Value {
    json!({"arguments": {"arm": {"devices": ["j1", "j2"]}}})
}

#[test]
fn names_that_are_not_there() {
    check(v(&[("a", "lib.gian")], json!({})), "UnknownName: there is no block 'lib.gian'; did you mean 'lib.gain'?");
    check(two(json!({"cells": {"d": ["gg.y"]}})), "UnknownName: 'gg.y' names the block 'gg', which does not exist; did you mean 'g'?");
    check(two(json!({"cells": {"d": ["g.yy"]}})), "UnknownName: 'g' (lib.gain) has no 'yy'; did you mean 'y'?");
    check(two(json!({"cells": {"d": ["g"]}})), "UnknownName: 'g' does not name a port; write label.port");
    check(
        two(json!({"command_lists": start(&["+s 1ms", "+q"])})),
        "UnknownName: command list 'start' names the block 'q', which does not exist; there are g, s",
    );
    check(two(json!({"command_lists": start(&["!x1"])})), "UnknownName: command list 'start' names the block 'x1', which does not exist; there are g, s");
    check(two(json!({"command_lists": start(&["-x1"])})), "UnknownName: command list 'start' names the block 'x1', which does not exist; there are g, s");
    check(two(json!({"command_lists": start(&["*x1"])})), "UnknownName: command list 'start' names the block 'x1', which does not exist; there are g, s");
    check(two(json!({"command_lists": start(&["? s.abov"])})), "UnknownName: 's' (lib.signal) has no 'abov'; did you mean 'above'?");
    check(two(json!({"command_lists": start(&["? gone"])})), "UnknownName: a wait of command list 'start' names the condition 'gone', which does not exist");
    check(two(json!({"command_lists": start(&["? s.y"])})), "UnknownName: 's.y' is not a condition: it is output 's.y' (double); there is only above");
    check(two(json!({"modes": {"g.v": "asynchronous"}})), "UnknownName: 'g' (lib.gain) has no 'v'; there are u, y, k");
    check(two(json!({"input_parameters": {"p": {"targets": ["g.kk"]}}})), "UnknownName: 'g' (lib.gain) has no 'kk'; did you mean 'k'?");
    check(two(json!({"output_values": {"p": "g.z"}})), "UnknownName: 'g' (lib.gain) has no 'z'; there are u, y, k");
    check(two(json!({"initial": "begin"})), "UnknownName: the initial command list 'begin' of verb 'v' does not exist; there is only start");
    check(two(json!({"blocks": {"g": {"constants": {"kk": 2.0}}}})), "UnknownName: 'g' (lib.gain) has no parameter 'kk'; did you mean 'k'?");
    check(
        (json!({"name": "v", "blocks": {}, "objects": {"arm": {"device_type": "Jiont"}}, "command_lists": start(&[])}), json!({})),
        "UnknownName: the object 'arm' has the device type 'Jiont', which does not exist; did you mean 'Joint'?",
    );
    check(
        with(movement(), json!({"instantiation_parameters": {"arm.sense": ["near.sensed"], "arm.sensed": []}}), arm()),
        "UnknownName: 'arm.sense': the device type 'Joint' has no SVV 'sense'; did you mean 'sensed'?",
    );
    check(
        with(movement(), json!({"input_parameters": {"arm.max_sped": {"targets": []}}}), arm()),
        "UnknownName: 'arm.max_sped': the device type 'Joint' has no parameter 'max_sped'; did you mean 'max_speed'?",
    );
    check(
        with(movement(), json!({"input_parameters": {"leg.max_speed": {"targets": []}}}), arm()),
        "UnknownName: the input parameter 'leg.max_speed' names the object 'leg', which does not exist; there is only arm",
    );
}

#[test]
fn conditions_and_transitions() {
    check(
        two(json!({"conditions": {"done": {}}})),
        "UnknownName: the condition 'done' is neither bound to a block condition nor a system condition; write on('label.condition'), or name one of completed, halted, fault, processor_lost, device_lost, device_disabled, aborted, emergency_stop, time_limit, overrun, late, link_lost, time_lost",
    );
    check(two(json!({"conditions": {"done": {"on": ["s.y"]}}})), "UnknownName: 's.y' is not a condition: it is output 's.y' (double); there is only above");
    check(
        two(json!({"conditions": {"done": {"on": ["s.above"], "returns": ["r"]}}})),
        "UnknownName: the condition 'done' returns 'r', which is not an output value",
    );
    check(
        two(json!({"conditions": {"done": {"on": ["s.above"], "during": "strat"}}})),
        "UnknownName: the condition 'done' applies during 'strat', which is not a command list; there is only start"
            .replace("there is only start", "did you mean 'start'?")
            .as_str(),
    );
    let from = |from: &str, condition: &str, to: &str| json!({"from": from, "condition": condition, "to": to});
    check(
        two(json!({"transitions": [from("begin", "fault", "start")]})),
        "UnknownName: the transition ('begin', 'fault') → 'start' names the command list 'begin', which does not exist; there is only start",
    );
    check(
        two(json!({"transitions": [from("start", "fault", "end")]})),
        "UnknownName: the transition ('start', 'fault') → 'end' names the command list 'end', which does not exist; there is only start",
    );
    check(
        two(json!({"transitions": [from("start", "falt", "start")]})),
        "UnknownName: the transition ('start', 'falt') → 'start' names the condition 'falt', which is not in the verb's table; did you mean 'fault'?",
    );
    check(
        two(json!({"transitions": [from("start", "fault", "start"), from("start", "fault", "start")]})),
        "DefinitionError: the transition ('start', 'fault') → 'start' conflicts with the one to 'start'; let a condition lead from a list to only one list",
    );
    check(
        two(json!({"command_lists": {"other": list(&[])}, "initial": "start", "conditions": {"c": {"on": ["s.above"], "during": "other"}},
        "transitions": [from("start", "c", "other")]})),
        "DefinitionError: the transition ('start', 'c') → 'other' can never be taken: 'c' holds only during 'other'; leave one of them out",
    );
    check(
        two(json!({"command_lists": {"other": list(&[])}})),
        "DefinitionError: verb 'v' has 2 command lists but no initial one; set initial= to one of start, other",
    );
    check(
        (json!({"name": "v", "blocks": {}, "command_lists": {}}), json!({})),
        "DefinitionError: verb 'v' has no command list; give one, for example {'start': [activate('block')]}",
    );
}

#[test]
fn covers() {
    check(
        two(json!({"cells": {"d": ["g.u"]}})),
        "CoverError: input 'g.u' (double) is covered by 'c' and by 'd'; a port has one binding; leave one of them out",
    );
    check(
        v(&[("g", "lib.gain")], json!({})),
        "CoverError: input 'g.u' (double) has no binding, default or input parameter; name it in an instantiation parameter, a cell or an input parameter, or give it a constant",
    );
    check(
        two(json!({"cells": {"d": ["g.k"]}})),
        "CoverError: 'd' covers parameter 'g.k' (double), which is not a port or device; reach parameters and conditions by input parameters",
    );
    check(v(&[("r", "lib.read_channel")], json!({})), "CoverError: device 'r.channel' (double) has no channel; name it in an instantiation parameter");
    check(
        two(json!({"blocks": {"g": {"constants": {"u": 1.0}}}})),
        "CoverError: input 'g.u' (double) is both given a constant and bound to 'c'; leave one of them out",
    );
    check(two(json!({"instantiation_parameters": {"c": []}})), "CoverError: 'c' is both an instantiation parameter and a cell; give them different names");
    check(
        v(&[("r", "lib.read_channel")], json!({"cells": {"c": ["r.channel"]}})),
        "TypeMismatch: device 'r.channel' (double) is covered by the cell 'c'; a device item takes a channel: make it an instantiation parameter",
    );
    check(
        two(json!({"input_parameters": {"c": {"targets": ["g.k"]}}, "instantiation_parameters": {"c": []}, "cells": {"c": [], "d": ["s.y", "g.u"]}})),
        "CoverError: 'c' is both an instantiation parameter and a cell; give them different names\nDefinitionError: 'c' is both an input parameter and an instantiation parameter or object; give them different names",
    );
}

#[test]
fn graphs() {
    let blocks = json!({"s": {"block": {"subroutine": "lib.signal"}}, "g": {"block": {"subroutine": "lib.gain"}}, "h": {"block": {"subroutine": "lib.gain"}}});
    let graph = |over: Value| with(json!({"name": "g", "blocks": blocks, "inputs": {"u": ["h.u"]}, "cells": {"c": ["s.y", "g.u"]}}), over, json!(null)).0;
    graph_check(graph(json!({})), "");
    graph_check(
        graph(json!({"inputs": {"v": ["h.y"]}})),
        "CoverError: the graph input 'v' covers the output 'h.y'; make it an output or a cell: a graph input leads only to inputs",
    );
    graph_check(
        graph(json!({"outputs": {"v": []}, "cells": {"c": ["s.y"]}, "inputs": {"w": []}})),
        "CoverError: input 'g.u' (double) has no binding, default or input parameter; name it in a cell or an input of the graph, or give it a constant",
    );
    graph_check(
        graph(json!({"outputs": {"y": ["g.y", "h.y"]}})),
        "SecondWriter: 'y' has two writers: output 'g.y' (double) and output 'h.y' (double); give each its own cell",
    );
    graph_check(
        graph(json!({"cells": {"d": ["g.y", "h.y"]}})),
        "SecondWriter: 'd' has two writers: output 'g.y' (double) and output 'h.y' (double); give each its own cell",
    );
    graph_check(graph(json!({"outputs": {"u": ["g.y"]}})), "CoverError: 'u' is both an input and an output of graph 'g'; give them different names");
    graph_check(graph(json!({"divide": {"x1": 2}})), "UnknownName: divide= of graph 'g' names 'x1', which is not one of its blocks; there are s, g, h");
    graph_check(graph(json!({"divide": {"s": 0}})), "SchedulingError: divide= of 's' is 0; give 1 or more");
    graph_check(
        graph(json!({"inputs": {"u": []}, "cells": {"c": ["g.y", "h.u"], "d": ["h.y", "g.u"]}})),
        "SynchronousCycle: synchronous ports form a cycle: 'g' → 'h' → 'g'; relax one of the inputs, for example with modes={'g.u': 'asynchronous'}",
    );
    graph_check(
        json!({"name": "g", "blocks": {"i": {"block": {"graph": graph(json!({}))}}}, "inputs": {"x": ["i.uu"]}}),
        "UnknownName: 'i' (graph g) has no 'uu'; did you mean 'u'?",
    );
    graph_check(
        json!({"name": "g", "blocks": {"o": {"block": {"subroutine": "lib.odd"}}}}),
        "DefinitionError: item 'u' of block 'lib.odd': cannot read the type 'doubel': there is no type 'doubel'; did you mean 'double'?",
    );
    let two_modes = |second: &str, modes: Value| json!({"name": "g", "blocks": {"a": {"block": {"subroutine": "lib.gain"}}, "b": {"block": {"subroutine": second}}}, "inputs": {"u": ["a.u", "b.u"]}, "modes": modes});
    graph_check(
        two_modes("lib.relaxed", json!({})),
        "SchedulingError: the graph input 'u' covers input 'a.u' (double), which is synchronous, and input 'b.u' (double), which is asynchronous: a port has one mode; relax one with modes={'a.u': 'asynchronous'}, or make it two inputs",
    );
    graph_check(
        two_modes("lib.slow_in", json!({})),
        "SchedulingError: the graph input 'u' covers input 'a.u' (double), which is synchronous, and input 'b.u' (double), which is ratio 4: a port has one mode; relax one with modes={'a.u': gpac.ratio(4)}, or make it two inputs",
    );
    graph_check(two_modes("lib.relaxed", json!({"a.u": "asynchronous"})), "");
    graph_check(two_modes("lib.slow_in", json!({"u": "asynchronous"})), "");
    graph_check(
        json!({"name": "g", "blocks": {"a.b": {"block": {"subroutine": "lib.signal"}}}}),
        "DefinitionError: the label 'a.b' of a block is empty or contains a dot",
    );
}

#[test]
fn types_and_units() {
    check(
        v(&[("s", "lib.signal"), ("n", "lib.narrow")], json!({"cells": {"c": ["s.y", "n.u"]}})),
        "TypeMismatch: cannot bind output 's.y' (double) to input 'n.u' (float): types differ; declare one of them as the other",
    );
    check(
        v(
            &[("p", "lib.pid"), ("q", "lib.pid")],
            json!({"cells": {"c": ["p.effort", "q.measured"]},
        "input_parameters": {"x": {"targets": ["p.measured", "p.setpoint", "q.setpoint"]}},
        "modes": {"p.measured": "asynchronous", "p.setpoint": "asynchronous", "q.setpoint": "asynchronous"}}),
        ),
        "UnitMismatch: cannot bind output 'p.effort' (double, N.m) to input 'q.measured' (double, rad): units differ; declare one of them as the other, or convert with a gain that has a unit, for example k='2 N.m/rad'",
    );
    check(
        v(
            &[("k", "lib.constant"), ("p", "lib.pid"), ("q", "lib.planner")],
            json!({"cells": {"c": ["k.y", "p.measured", "q.speed"]},
        "blocks": {"q": {"constants": {"n": 1, "goal": [0.0]}}}, "instantiation_parameters": {"s": ["q.start"]}, "input_parameters": {"x": {"targets": ["p.setpoint"]}}, "modes": {"p.setpoint": "asynchronous"}}),
        ),
        "CallError: verb 'v' needs the instantiation parameter 's'; give an SVV or a channel, or make it a cell of the verb",
    );
    check(
        v(
            &[("k", "lib.constant"), ("p", "lib.pid"), ("q", "lib.planner")],
            json!({"cells": {"c": ["k.y", "p.measured", "q.speed"], "s": ["q.start"]},
        "blocks": {"q": {"constants": {"n": 1, "goal": [0.0]}}}, "input_parameters": {"x": {"targets": ["p.setpoint"]}}, "modes": {"p.setpoint": "asynchronous"}}),
        ),
        "UnitMismatch: cannot bind input 'p.measured' (double, rad) to input 'q.speed' (double, rad/s): units differ; declare one of them as the other, or convert with a gain that has a unit, for example k='2 N.m/rad'",
    );
    let svv = |name: &str| json!({"arguments": {"x": {"svv": name}}});
    let relaxed = |name| with(verb(&[("h", "lib.relaxed")], json!({"instantiation_parameters": {"x": ["h.u"]}})), json!({}), svv(name));
    check(relaxed("f"), "TypeMismatch: cannot bind SVV 'f' (float) to input 'h.u' (double): types differ; declare one of them as the other");
    check(relaxed("aa"), "UnknownName: there is no SVV 'aa'; did you mean 'a'?");
    let vector =
        |argument: Value| (verb(&[("h", "lib.vector")], json!({"instantiation_parameters": {"x": ["h.q", "h.y"]}})), json!({"arguments": {"x": argument}}));
    check(
        vector(json!({"svv": "speed"})),
        "TypeMismatch: cannot bind SVV 'speed' (double, rad/s) to input 'h.q' (double[6], rad): types differ; declare one of them as the other\nTypeMismatch: cannot bind SVV 'speed' (double, rad/s) to output 'h.y' (double[6], rad): types differ; declare one of them as the other",
    );
    check(
        vector(json!({"svvs": ["j1.sensed", "j1.sensed", "j1.goal", "j2.goal", "j2.sensed", "j2.commanded"]})),
        "SecondWriter: SVV 'j1.sensed' appears twice in the list for 'x', which is written to; give each SVV once",
    );
    check(
        (verb(&[("h", "lib.vector")], json!({"instantiation_parameters": {"x": ["h.q"]}})), json!({"arguments": {"x": {"svvs": ["j1.sensed", "j2.sensed"]}}})),
        "TypeMismatch: cannot bind 2 SVVs 'j1.sensed', … (double each, rad) to input 'h.q' (double[6], rad): the numbers of elements differ; give one SVV for each element",
    );
    let channel = |block: &str, item: &str, channel: &str| {
        (
            verb(
                &[("r", block)],
                if block == "lib.write_channel" {
                    json!({"instantiation_parameters": {"x": [format!("r.{item}")]}, "cells": {"u": ["r.u"]}, "modes": {"r.u": "asynchronous"}})
                } else {
                    json!({"instantiation_parameters": {"x": [format!("r.{item}")]}})
                },
            ),
            json!({"arguments": {"x": {"channel": {"device": "ur5e", "channel": channel}}}}),
        )
    };
    check(
        channel("lib.read_channel", "channel", "mass"),
        "TypeMismatch: cannot bind channel 'ur5e.mass' (float, kg) to device 'r.channel' (double): types differ; declare one of them as the other",
    );
    check(
        channel("lib.read_channel", "channel", "j1.effort"),
        "TypeMismatch: cannot bind channel 'ur5e.j1.effort' (double, N.m) to device 'r.channel' (double): the channel is written, but the block reads it; give a channel that is read",
    );
    check(
        channel("lib.write_channel", "channel", "j1.position"),
        "TypeMismatch: cannot bind channel 'ur5e.j1.position' (double, rad) to device 'r.channel' (double): the channel is read, but the block writes it; give a channel that is written",
    );
    check(
        channel("lib.relaxed", "u", "j1.position"),
        "TypeMismatch: cannot bind channel 'ur5e.j1.position' (double, rad) to input 'r.u' (double): only a device item can be bound to a channel; put library.read_channel or library.write_channel between them",
    );
    check(
        channel("lib.read_channel", "channel", "j3.position"),
        "UnknownName: the physical device 'ur5e' has no channel 'j3.position'; did you mean 'j1.position'?",
    );
    check(
        (verb(&[("r", "lib.read_channel")], json!({"instantiation_parameters": {"x": ["r.channel"]}})), json!({"arguments": {"x": {"svv": "a"}}})),
        "TypeMismatch: cannot bind SVV 'a' (double) to device 'r.channel' (double): it takes a channel of a physical device; give a channel",
    );
    check(
        two(json!({"blocks": {"g": {"constants": {"k": "fast"}}}})),
        "ValueRefused: the constant for parameter 'g.k' (double): 'fast' is not a number with a unit; write a number, or, for example, '20 ms' or '90 deg'",
    );
    check(
        two(json!({"blocks": {"s": {"constants": {"frequency": "5 ms"}}}})),
        "UnitMismatch: the constant for parameter 's.frequency' (double, Hz): cannot convert '5 ms' to Hz: the dimensions differ; give a number or a quantity in Hz",
    );
    check(
        two(json!({"input_parameters": {"p": {"targets": ["g.k"], "default": [1.0]}}})),
        "ValueRefused: the default of the input parameter 'p': double takes a number, not a list of 1",
    );
    check(
        v(&[("g", "lib.generator")], json!({"cells": {"c": ["g.coefficients"]}})),
        "TypeMismatch: the size 'n' of 'g' (lib.generator) is not known; bind an array or a list to it, or give n= as a constant",
    );
    check(
        v(&[("g", "lib.generator")], json!({"cells": {"c": ["g.coefficients"]}, "blocks": {"g": {"constants": {"n": 9}}}})),
        "ValueRefused: the size 'n' of 'g' is 9, but lib.generator takes 1 to 8; choose a number of elements within that range",
    );
}

#[test]
fn what_never_ends_a_verb_returns_nothing() {
    let leads_on = |transitions: Value| {
        let lists = json!({"start": list(&["+s 1ms", "+g"]), "back": list(&["+s 1ms", "+g"])});
        let on = json!({"high": {"on": ["s.above"], "returns": ["y"]}});
        two(json!({"command_lists": lists, "initial": "start", "output_values": {"y": "g.y"}, "conditions": on, "transitions": transitions}))
    };
    let way = |from: &str, to: &str| json!({"from": from, "condition": "high", "to": to});
    check(
        leads_on(json!([way("start", "back"), way("back", "start")])),
        "DefinitionError: the condition 'high' has returns= but never ends the verb: every command list in which it holds has a transition for it; leave returns= out, or give it to the condition that ends the verb",
    );
    let (verb, application) = leads_on(json!([way("start", "back")]));
    assert!(apply_json(verb, application).is_ok(), "it ends the second list");
    let way = |from: &str| json!({"from": from, "condition": "halted", "to": "back"});
    let lists = json!({"start": list(&["+s 1ms", "+g"]), "back": list(&["+s 1ms", "+g"])});
    let (verb, application) = two(json!({"command_lists": lists, "initial": "start", "output_values": {"y": "g.y"},
        "conditions": {"halted": {"returns": ["y"]}}, "transitions": [way("start"), way("back")]}));
    assert!(apply_json(verb, application).is_ok(), "the end to which it leads reports it");
}

#[test]
fn words_of_a_call_are_no_names_of_parameters() {
    for name in ["time_limit", "overruns", "age_max", "every", "self", "class", "lambda"] {
        check(
            two(json!({"input_parameters": {name: {"targets": ["g.k"]}}})),
            &format!(
                "DefinitionError: an input parameter of verb 'v' cannot be named '{name}': calls use that name themselves; choose another name, for example '{name}_value'"
            ),
        );
    }
    let (verb, application) = two(json!({"instantiation_parameters": {"time_limit": ["g.y"]}}));
    check(
        (verb, application),
        "DefinitionError: an argument of verb 'v' cannot be named 'time_limit': calls use that name themselves; choose another name, for example 'time_limit_value'",
    );
}

#[test]
fn units_pass_through_blocks() {
    // s.y has no unit, q.y is in rad: the unit after a gain depends on its factor.
    let chain = |k: Value| {
        let rest = json!({"blocks": {"g": {"constants": {"k": k}}}, "instantiation_parameters": {"from": ["g.u"], "to": ["g.y", "p.setpoint"]},
            "input_parameters": {"m": {"targets": ["p.measured"]}}, "modes": {"g.u": "asynchronous", "p.measured": "asynchronous"}});
        (verb(&[("g", "lib.gain"), ("p", "lib.pid")], rest), json!({"arguments": {"from": {"svv": "speed"}, "to": {"svv": "a"}}}))
    };
    let refused = "UnitMismatch: cannot bind output 'g.y' (double, rad/s) to input 'p.setpoint' (double, rad): units differ; declare one of them as the other, or convert with a gain that has a unit, for example k='2 N.m/rad'";
    check(chain(json!(2.0)), refused);
    check(chain(json!("50 %")), refused);
    assert!(apply_json(chain(json!("2 s")).0, chain(json!("2 s")).1).is_ok());
    check(chain(json!("2 kg")), &refused.replace("(double, rad/s)", "(double, kg.rad/s)"));
    // The unit of an input parameter is unknown unless declared.
    let tunable = |input: Value| {
        let (mut verb, application) = chain(json!(1.0));
        verb["blocks"]["g"]["constants"] = json!({});
        verb["input_parameters"]["k"] = input;
        (verb, application)
    };
    assert!(apply_json(tunable(json!({"targets": ["g.k"]})).0, chain(json!(1.0)).1).is_ok());
    check(tunable(json!({"targets": ["g.k"], "unit": "N"})), &refused.replace("(double, rad/s)", "(double, N.rad/s)"));
    // Units propagate through any number of blocks, in any order of declaration.
    let rest = json!({"instantiation_parameters": {"from": ["a.u"], "to": ["c.y"]}, "cells": {"x": ["a.y", "b.u"], "y": ["b.y", "c.u"]}, "modes": {"a.u": "asynchronous"}});
    let row = verb(&[("c", "lib.gain"), ("b", "lib.gain"), ("a", "lib.gain")], rest);
    check(
        (row, json!({"arguments": {"from": {"svv": "j1.sensed"}, "to": {"svv": "speed"}}})),
        "UnitMismatch: cannot bind SVV 'speed' (double, rad/s) to output 'c.y' (double, rad): units differ; declare one of them as the other, or convert with a gain that has a unit, for example k='2 N.m/rad'",
    );
    check(
        two(json!({"input_parameters": {"p": {"targets": ["g.k"], "unit": "Nm"}}})),
        "UnitMismatch: the input parameter 'p': there is no unit 'Nm'; did you mean 'N.m'?",
    );
    let mut odd = cell();
    odd.interfaces.insert("lib.far".into(), interface("lib.far", &["out double y furlong"]));
    let refusals = apply_in(odd, verb(&[("f", "lib.far")], json!({})), json!({})).map(|_| ()).expect_err("nobody knows a furlong");
    assert!(texts(&refusals).starts_with("UnitMismatch: item 'y' of block 'lib.far': there is no unit 'furlong'"), "{}", texts(&refusals));
}

#[test]
fn all_errors_come_at_once_with_their_places() {
    let mut program = verb(&[("a", "lib.gian"), ("s", "lib.signal")], json!({"cells": {"c": ["s.why"]}, "initial": "begin"}));
    program["blocks"]["s"]["constants"] = json!({"kk": 1});
    let refusals = apply_json(program, json!({})).unwrap_err();
    assert_eq!(refusals.len(), 4, "{}", texts(&refusals));
    assert!(refusals[0].to_string().ends_with(" at p.py:7"), "{}", refusals[0]);
    assert!(refusals[2].to_string().ends_with(" at p.py:3"), "{}", refusals[2]);
}
