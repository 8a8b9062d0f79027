// SPDX-License-Identifier: Apache-2.0
//! Refusals of calls: their arguments, scheduling and placement.
use super::*;

#[test]
fn calls() {
    check((movement(), json!({})), "CallError: verb 'move' requires the argument 'arm', a Joint; pass a logical device");
    check(
        (movement(), json!({"arguments": {"arm": {"devices": ["j1"]}, "amr": {"svv": "a"}}})),
        "CallError: verb 'move' has no instantiation parameter 'amr'; did you mean 'arm'?",
    );
    check(
        (movement(), json!({"arguments": {"arm": {"devices": ["j1"]}, "speed": {"svv": "a"}}})),
        "CallError: verb 'move' has no instantiation parameter 'speed'; 'speed' is an input parameter; give it at the start",
    );
    check((movement(), json!({"arguments": {"arm": {"devices": ["j1", "j9"]}}})), "UnknownName: there is no logical device 'j9'; there are j1, j2");
    check(
        (movement(), json!({"arguments": {"arm": {"devices": ["j1", "j1"]}}})),
        "CallError: 'arm' of verb 'move' is given the device 'j1' twice; give each device once",
    );
    check((movement(), json!({"arguments": {"arm": {"svv": "a"}}})), "CallError: 'arm' of verb 'move' takes a Joint; pass a logical device");
    check(
        with(movement(), json!({"objects": {"arm": {"each": false}}}), arm()),
        "CallError: 'arm' of verb 'move' takes one Joint, not 2; declare it with each() to take several",
    );
    check(
        (servo(), json!({"arguments": {"sensed": {"svv": "a"}, "commanded": {"svv": "b"}}})),
        "CallError: verb 'joint_servo' needs 'drive', a part of a physical device with a channel 'position'; give, for example, arm['elbow']\nCallError: verb 'joint_servo' needs 'drive', a part of a physical device with a channel 'effort'; give, for example, arm['elbow']",
    );
    check(
        (servo(), json!({"arguments": {"drive": {"part": {"device": "ur5e", "part": "j1"}}, "sensed": {"svv": "a"}}})),
        "CallError: verb 'joint_servo' needs the instantiation parameter 'commanded'; give an SVV or a channel, or make it a cell of the verb",
    );
    let nothing = model::apply(&serde_json::from_value(json!({"verb": "mvoe"})).unwrap(), &cell()).unwrap_err();
    assert_eq!(texts(&nothing), "UnknownName: there is no verb 'mvoe'; did you mean 'move'?");
}

#[test]
fn scheduling() {
    check(two(json!({"modes": {"g.u": {"ratio": 0}}})), "SchedulingError: the ratio of input 'g.u' (double) is 0; give 1 or more");
    check(
        v(&[("h", "lib.relaxed"), ("s", "lib.signal")], json!({"cells": {"c": ["s.y", "h.u"]}, "modes": {"h.u": "synchronous"}})),
        "SchedulingError: input 'h.u' (double) is asynchronous, but modes= would make it synchronous; use modes= only to relax a declared mode, never to tighten it",
    );
    check(two(json!({"modes": {"g.k": "asynchronous"}})), "SchedulingError: modes= gives a mode to parameter 'g.k' (double), which is not a port");
    check(
        two(json!({"command_lists": start(&["+s 1ms", "+g 1ms"])})),
        "SchedulingError: command list 'start' gives 'g' an execution interval, but a synchronous input drives it; write activate('g'), or relax what drives it with modes={'g.u': 'asynchronous'}",
    );
    check(
        two(json!({"command_lists": start(&["+s 0s"])})),
        "SchedulingError: command list 'start' activates 's' with an interval of 0; give a positive interval, for example every='1 ms'",
    );
    check(
        two(json!({"command_lists": start(&["+g"])})),
        "SchedulingError: nothing drives input 'g.u' (double): it is synchronous, and no active block writes cell 'c' in command list 'start'; bind a writer to cell 'c' and activate it, or relax it with modes={'g.u': 'asynchronous'}",
    );
    check(
        (
            verb(&[("g", "lib.gain")], json!({"instantiation_parameters": {"x": ["g.u"]}, "command_lists": start(&["+g"])})),
            json!({"arguments": {"x": {"svv": "a"}}}),
        ),
        "SchedulingError: nothing drives input 'g.u' (double): it is synchronous, and no active block writes SVV 'a' in command list 'start'; bind a writer to SVV 'a' and activate it, or relax it with modes={'g.u': 'asynchronous'}",
    );
    check(
        v(
            &[("s", "lib.signal"), ("r", "lib.signal"), ("m", "lib.sum")],
            json!({"cells": {"c": ["s.y", "m.a"], "d": ["r.y", "m.b"]}, "command_lists": start(&["+s 1ms", "+r 2ms", "+m"])}),
        ),
        "SchedulingError: input 'm.a' (double) is driven every 1 ms, but input 'm.b' (double) every 2 ms: synchronous inputs of a block must update at the same rate; relax it with modes={'m.b': 'asynchronous'}",
    );
    check(
        v(&[("s", "lib.signal"), ("i", "lib.slow_in")], json!({"cells": {"c": ["s.y", "i.u"]}, "command_lists": start(&["+s 3ms", "+i 1ms"])})),
        "SchedulingError: input 'i.u' (double) has ratio 4 and runs every 1 ms, but output 's.y' (double) updates every 3 ms: it would have to update every 4 ms; change one of the intervals, or relax the input with modes={'i.u': 'asynchronous'}",
    );
    check(
        v(&[("a", "lib.gain"), ("b", "lib.gain")], json!({"cells": {"c": ["a.y", "b.u"], "d": ["b.y", "a.u"]}})),
        "SynchronousCycle: synchronous ports form a cycle: 'a' → 'b' → 'a'; relax one of the inputs, for example with modes={'a.u': 'asynchronous'}",
    );
    check(
        v(&[("s", "lib.signal"), ("r", "lib.signal")], json!({"cells": {"c": ["s.y", "r.y"]}, "command_lists": start(&["+s 1ms", "+r 1ms"])})),
        "SecondWriter: cell 'c' has two active writers in command list 'start': output 's.y' (double) and output 'r.y' (double); give one of them its own cell, or deactivate it first",
    );
    check(
        (verb(&[("s", "lib.signal")], json!({"command_lists": start(&["+s 1ms"])})), json!({"every": {"x1": 1_000_000}})),
        "UnknownName: every= names 'x1', which verb 'v' does not activate; there is only s",
    );
    check(
        (verb(&[("s", "lib.signal")], json!({"command_lists": start(&["+s 1ms"])})), json!({"every": {"s": 0}})),
        "SchedulingError: every= gives 's' an interval of 0; give a positive interval, for example '1 ms'",
    );
    let (program, _) = two(json!({}));
    check(
        (program, json!({"every": {"g": 1_000_000}})),
        "SchedulingError: every= gives 'g' an execution interval, but a synchronous input drives it; give the interval to the block that drives it",
    );
}

#[test]
fn nothing_runs_without_a_new_value() {
    check(
        two(json!({"command_lists": start(&["!s", "!g"])})),
        "SchedulingError: command list 'start' executes 'g', but input 'g.u' (double) is synchronous: an execution brings it no new value; put it into a graph with the block that writes that input and execute the graph, or relax the input with modes={'g.u': 'asynchronous'}",
    );
    let graph = json!({"graph": {"name": "g", "blocks": {"a": {"block": {"subroutine": "lib.gain"}}, "b": {"block": {"subroutine": "lib.gain"}}},
        "inputs": {"u": ["a.u"]}, "outputs": {"y": ["b.y"]}, "cells": {"c": ["a.y", "b.u"]}}});
    let rest = json!({"blocks": {"g": {"block": graph, "place": {"file": "p.py", "line": 7}}}, "instantiation_parameters": {"x": ["g.u"]}, "command_lists": start(&["!g"])});
    check(
        (with(verb(&[], json!({})), rest, json!({})).0, json!({"arguments": {"x": {"svv": "a"}}})),
        "SchedulingError: command list 'start' executes 'g', but input 'g.a.u' (double) is synchronous: an execution brings it no new value; put it into a graph with the block that writes that input and execute the graph, or relax the input with modes={'g.a.u': 'asynchronous'}",
    );
    let given = json!({"input_parameters": {"p": {"targets": ["g.u"]}}, "command_lists": start(&["+g"])});
    check(
        v(&[("g", "lib.gain")], given.clone()),
        "SchedulingError: nothing drives input 'g.u' (double): it is synchronous, and only the input parameter 'p' stores into it, which does not count as a new value; relax it with modes={'g.u': 'asynchronous'}, or bind a writer to it",
    );
    check(
        v(&[("g", "lib.slow_in")], given.clone()),
        "SchedulingError: nothing drives input 'g.u' (double): it is ratio 4, and only the input parameter 'p' stores into it, which does not count as a new value; relax it with modes={'g.u': 'asynchronous'}, or bind a writer to it",
    );
    check(
        v(&[("g", "lib.gain"), ("h", "lib.relaxed")], json!({"cells": {"c": ["g.u", "h.u"]}, "command_lists": start(&["+h 1ms", "+g"])})),
        "SchedulingError: nothing drives input 'g.u' (double): it is synchronous, and no block writes its cell; relax it with modes={'g.u': 'asynchronous'}, or bind a writer to it",
    );
    // A constant cannot be new, and an asynchronous input waits for nothing.
    let constant = json!({"blocks": {"g": {"constants": {"u": 2.0}}}, "command_lists": start(&["!g", "+g 1ms"])});
    assert!(apply_json(verb(&[("g", "lib.gain")], constant), json!({})).is_ok());
    let relaxed = with(verb(&[("g", "lib.gain")], given), json!({"modes": {"g.u": "asynchronous"}, "command_lists": start(&["+g 1ms"])}), json!({}));
    assert!(apply_json(relaxed.0, relaxed.1).is_ok());
}

#[test]
fn placement() {
    let signal = |command: &str| verb(&[("s", "lib.signal")], json!({"command_lists": start(&[command])}));
    check((signal("+s 1500us"), json!({})), "PlacementError: 's' needs a 1.5 ms timer, but there is none on 'rtp0'; create one, or change the interval");
    check(
        (signal("+s 1500us"), json!({"placement": {"s": "rtp0.fast"}})),
        "SchedulingError: the interval of 's' (1.5 ms) is not a whole multiple of the period of 'rtp0.fast' (1 ms); change the interval, or place it on another timer",
    );
    check(
        (signal("+s"), json!({"placement": {"s": "rtp0.fast"}})),
        "SchedulingError: 's' is activated without an interval, but its source 'rtp0.fast' is a timer; write activate('s', every='1 ms'), or place it on a trigger",
    );
    check(
        (signal("+s 1ms"), json!({"placement": {"s": "rtp0.door"}})),
        "SchedulingError: 's' has the interval 1 ms, but its source 'rtp0.door' is not a timer; place it on a timer, or write activate('s')",
    );
    check(
        (signal("+s 1ms"), json!({"placement": {"s": "rtp0.fats"}})),
        "UnknownName: the placement of 's' names the source 'rtp0.fats', which does not exist; did you mean 'rtp0.fast'?",
    );
    check((signal("+s 1ms"), json!({"placement": {"x1": "rtp0.fast"}})), "UnknownName: the placement of 'x1' matches no block of verb 'v'; there is only s");
    check(
        (servo(), json!({"owner": "j1", "placement": {"read": "rtp0.slow"}})),
        "PlacementError: 'read' is placed on 'rtp0.slow', but its device 'ur5e' belongs to 'rtp0.fast'; place 'read' on 'rtp0.fast'",
    );
    let (program, _) = two(json!({}));
    check(
        (program, json!({"placement": {"s": "rtp0.fast", "g": "rtp0.slow"}})),
        "SchedulingError: 'g' is placed on 'rtp0.slow', but what drives it runs on 'rtp0.fast'; place it there or on a software source, or relax the input with modes=",
    );
    let sum = verb(
        &[("s", "lib.signal"), ("r", "lib.signal"), ("m", "lib.sum")],
        json!({"cells": {"c": ["s.y", "m.a"], "d": ["r.y", "m.b"]}, "command_lists": start(&["+s 20ms", "+r 20ms", "+m"])}),
    );
    check(
        (sum, json!({"placement": {"s": "rtp0.fast", "r": "rtp0.slow"}})),
        "PlacementError: 'm' is driven from 'rtp0.fast' and 'rtp0.slow'; place it on a software source, or relax all but one of its inputs with modes=",
    );
    let mut pair = cell();
    let slow = json!({"processor": "rtp0", "source": "rtp0.slow", "channels": [{"name": "z", "write": true, "type_text": "double", "unit": ""}]});
    pair.devices.insert("lamp".into(), serde_json::from_value(slow).unwrap());
    pair.interfaces.insert("lib.copy".into(), interface("lib.copy", &["read double a", "write double b"]));
    let rest = json!({"instantiation_parameters": {"x": ["c.a"], "y": ["c.b"]}});
    let channel = |device: &str, channel: &str| json!({"channel": {"device": device, "channel": channel}});
    let refusals =
        apply_in(pair, verb(&[("c", "lib.copy")], rest), json!({"arguments": {"x": channel("ur5e", "j1.position"), "y": channel("lamp", "z")}})).unwrap_err();
    assert_eq!(
        texts(&refusals),
        "PlacementError: 'c' has the devices 'ur5e' of 'rtp0.fast' and 'lamp' of 'rtp0.slow'; use one block for each device at p.py:7"
    );
    let mut twin = cell();
    let source = twin.sources["rtp0.slow"].clone();
    twin.sources.insert("rtp0.twin".into(), source);
    let refusals = apply_in(twin, signal("+s 20ms"), json!({})).unwrap_err();
    assert_eq!(
        texts(&refusals),
        "PlacementError: 's' needs a 20 ms timer, but 'rtp0.slow' and 'rtp0.twin' fit equally well; choose one with .on({'s': …}) or place() at p.py:7"
    );
}
