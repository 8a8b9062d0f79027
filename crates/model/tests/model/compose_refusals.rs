// SPDX-License-Identifier: Apache-2.0
//! Incompatible parts: each refusal names both and the remedy, and all are reported at once.
use crate::common::*;
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

/// Returns the refusal of parts `a` and `b`, which may differ from the plain one, with further members of the composition.
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

/// Does the same for two complete parts.
fn refused_of(a: Value, b: Value, rest: Value) -> String {
    let mut whole = json!({"name": "whole", "parts": {"a": a, "b": b}, "transitions": [{"from": "a", "to": "b"}], "place": {"file": "c.py", "line": 9}});
    merge(&mut whole, rest);
    let whole: Composition = serde_json::from_value(whole).expect("a composition");
    texts(&model::compose(&whole, &cell()).err().unwrap_or_default())
}

/// Returns a verb of one block `b`, activated at `every`; without an interval it is driven.
fn one(name: &str, block: &str, every: &str, rest: Value) -> Value {
    let mut one = verb(&[("b", block)], json!({"name": name, "command_lists": start(&[format!("+b {every}").trim()])}));
    merge(&mut one, rest);
    one
}

#[test]
fn a_composition_has_parts_that_are_verbs_with_plain_labels() {
    let none: Composition = serde_json::from_value(json!({"name": "whole", "parts": {}})).expect("a composition");
    let none = texts(&model::compose(&none, &cell()).err().unwrap_or_default());
    assert_eq!(none, "DefinitionError: the composition 'whole' has no parts; give it verbs by label: {'approach': approach, 'grasp': grasp}");
    let wrong = refused(json!({"output_values": {"last": "s.x"}}), plain(), plain());
    assert_eq!(wrong, "UnknownName: part 'a' of 'whole': 's' (lib.signal) has no 'x'; there are y, frequency, above at p.py:3");
    let dotted = refused(json!({"output_values": {"last.y": "s.y"}}), plain(), plain());
    assert_eq!(
        dotted,
        "DefinitionError: part 'a' of 'whole' has a condition or output 'last.y', but a dot separates a name from its part; give it a plain name in its verb at p.py:3"
    );
    let label = refused(plain(), plain(), json!({"parts": {"c.d": part("third", plain())}}));
    assert_eq!(label, "DefinitionError: the label 'c.d' of a part of 'whole' is empty or contains a dot; give the part a plain name at c.py:9");
}

#[test]
fn rename_and_preset_name_something_of_a_part() {
    let given = json!({"a.limt": "x", "c.limit": "x", "limit": "x", "b.limit": "x.y", "b.enough": "completed"});
    assert_eq!(
        refused(plain(), plain(), json!({"rename": given})),
        "UnknownName: rename= names 'a.limt', but part 'a' (verb 'first') has no parameter, object, output or condition 'limt'; did you mean 'limit'? at c.py:9\n\
         UnknownName: rename= names 'c.limit', but no part of 'whole' is called 'c'; there are a, b at c.py:9\n\
         UnknownName: rename= names 'limit', but no part of 'whole' is called 'limit'; write part.name at c.py:9\n\
         DefinitionError: rename= gives 'b.limit' the name 'x.y', which is empty or contains a dot; give it a plain name at c.py:9\n\
         DefinitionError: rename= calls the condition 'b.enough' 'completed', but a system condition keeps its name and stands for itself; give it another name at c.py:9"
    );
    assert_eq!(
        refused(plain(), plain(), json!({"rename": {"a.y": "limit"}})),
        "CompositionConflict: rename= merges two parameters of part 'a' (verb 'first'): 'y' and 'limit' would both be 'limit'; give them different names at c.py:9"
    );
    assert_eq!(
        refused(plain(), plain(), json!({"preset": {"a.y": 1, "b.limit": "red"}})),
        "UnknownName: preset= names 'a.y', but part 'a' (verb 'first') has no input parameter 'y'; there is only limit at c.py:9\n\
         ValueRefused: the preset of 'limit' of part 'b' (verb 'second'): 'red' is not a number with a unit; write a number, or, for example, '20 ms' or '90 deg' at c.py:9"
    );
}

#[test]
fn what_has_one_name_is_one_thing() {
    assert_eq!(
        refused(plain(), plain(), json!({"rename": {"b.limit": "y", "b.y": "z"}})),
        "CompositionConflict: 'y' is an instantiation parameter in part 'a' but an input parameter in part 'b'; rename one: rename={'b.limit': 'b_y'} at c.py:9"
    );
    let narrow = one(
        "second",
        "lib.narrow",
        "1ms",
        json!({"instantiation_parameters": {"z": ["b.y"]}, "modes": {"b.u": "asynchronous"}, "input_parameters": {"u": {"targets": ["b.u"]}}, "output_values": {"last": "b.y"}, "conditions": {"completed": {"returns": ["last"]}}}),
    );
    assert_eq!(
        refused_of(part("first", plain()), narrow.clone(), json!({"rename": {"b.z": "y", "b.last": "b_last"}})),
        "TypeMismatch: 'y' of part 'a' and part 'b' cannot be merged: it is output 'a.s.y' (double) and output 'b.b.y' (float): types differ; rename one: rename={'b.z': 'b_y'} at c.py:9"
    );
    assert_eq!(
        refused_of(part("first", plain()), narrow, plain()),
        "TypeMismatch: 'last' of part 'a' and part 'b' cannot be merged: it is output 'a.s.y' (double) and output 'b.b.y' (float): types differ; rename one: rename={'b.last': 'b_last'} at c.py:9"
    );
    let near = |name: &str, port: &str, other: &str| {
        one(name, "lib.near", "1ms", json!({"instantiation_parameters": {"q": [port]}, "input_parameters": {"g": {"targets": [other]}}}))
    };
    let servo = one(
        "second",
        "lib.pid",
        "1ms",
        json!({"instantiation_parameters": {"q": ["b.effort"]}, "modes": {"b.measured": "asynchronous", "b.setpoint": "asynchronous"},
        "input_parameters": {"g": {"targets": ["b.measured"]}, "h": {"targets": ["b.setpoint"]}, "kp": {"targets": ["b.kp"]}, "limit": {"targets": ["b.limit"]}}}),
    );
    assert_eq!(
        refused_of(near("first", "b.sensed", "b.goal"), servo, json!({"rename": {"b.g": "m"}})),
        "UnitMismatch: 'q' of part 'a' and part 'b' cannot be merged: it is input 'a.b.sensed' (double[n], rad) and output 'b.b.effort' (double, N.m): units differ; rename one: rename={'b.q': 'b_q'} at c.py:9"
    );
    let channel = |name: &str, block: &str| one(name, block, "1ms", json!({"instantiation_parameters": {"drive.x": ["b.channel"]}}));
    let mut writing = channel("second", "lib.write_channel");
    writing["input_parameters"] = json!({"u": {"targets": ["b.u"]}});
    writing["modes"] = json!({"b.u": "asynchronous"});
    assert_eq!(
        refused_of(channel("first", "lib.read_channel"), writing, plain()),
        "TypeMismatch: 'drive.x' of part 'a' and part 'b' cannot be merged: it is device 'a.b.channel' (double) and device 'b.b.channel' (double): one takes a channel that is read, the other a channel that is written; rename one: rename={'b.drive': 'b_drive'} at c.py:9"
    );
    let mut single = movement();
    single["objects"]["arm"]["each"] = json!(false);
    assert_eq!(
        refused_of(movement(), single, plain()),
        "TypeMismatch: the object 'arm' is several of 'Joint' in part 'a' but one 'Joint' in part 'b'; rename one: rename={'b.arm': 'b_arm'} at c.py:9"
    );
}

#[test]
fn an_input_of_one_name_has_one_default_and_unit() {
    assert_eq!(
        refused(plain(), json!({"input_parameters": {"limit": {"default": 4.0}}}), plain()),
        "CompositionConflict: the input 'limit' defaults to 3.0 in part 'a' but to 4.0 in part 'b'; rename one: rename={'b.limit': 'b_limit'}, or fix one: preset={'b.limit': 4.0} at c.py:9"
    );
    assert_eq!(
        refused(json!({"input_parameters": {"limit": {"unit": "N"}}}), json!({"input_parameters": {"limit": {"unit": "rad"}}}), plain()),
        "UnitMismatch: the input 'limit' is in N in part 'a' but in rad in part 'b'; rename one: rename={'b.limit': 'b_limit'} at c.py:9"
    );
}

#[test]
fn shared_blocks_are_the_same_use_with_the_same_bindings() {
    let share = json!({"share": ["s"]});
    assert_eq!(
        refused(plain(), plain(), json!({"share": ["a", "t"]})),
        "CompositionConflict: share= names the block 'a', but a part of 'whole' has that label; give the part another label at c.py:9\n\
         UnknownName: share= names the block 't', which no part has; there is only s at c.py:9"
    );
    assert_eq!(
        refused(json!({"blocks": {"s": {"constants": {"frequency": 2.0}}}}), plain(), share.clone()),
        "CompositionConflict: 's' cannot be shared by part 'a' and part 'b': they are different constants; make them equal, or leave it out of share at c.py:9"
    );
    assert_eq!(
        refused_of(part("first", plain()), verb(&[("s", "lib.constant")], json!({"name": "second", "command_lists": start(&["+s 1ms"])})), share.clone()),
        "CompositionConflict: 's' cannot be shared by part 'a' and part 'b': they are different blocks; make them equal, or leave it out of share at c.py:9"
    );
    assert_eq!(
        refused(plain(), plain(), json!({"share": ["s"], "rename": {"b.y": "z"}})),
        "CompositionConflict: 's' cannot be shared by part 'a' and part 'b': its output 's.y' (double) is bound to the parameter 'y' in the first and to the parameter 'z' in the second; bind it to a parameter or cell of one name in both at c.py:9"
    );
    let moded = verb(
        &[("g", "lib.gain")],
        json!({"name": "second", "instantiation_parameters": {"x": ["g.u"]}, "modes": {"g.u": "asynchronous"}, "command_lists": start(&["+g 1ms"])}),
    );
    let driven = verb(&[("g", "lib.gain")], json!({"name": "first", "instantiation_parameters": {"x": ["g.u"]}, "command_lists": start(&["+g"])}));
    assert_eq!(
        refused_of(driven, moded, json!({"share": ["g"]})),
        "CompositionConflict: 'g' cannot be shared by part 'a' and part 'b': its input 'g.u' (double) has two modes; give it one mode with modes= at c.py:9"
    );
}

#[test]
fn transitions_lead_from_what_ends_a_part_to_a_part() {
    let line = |from: &str, condition: &str, to: &str| refused(plain(), plain(), json!({"transitions": [{"from": from, "condition": condition, "to": to}]}));
    assert_eq!(
        line("c", "enough", "b"),
        "UnknownName: the transition ('c', 'enough') → 'b' begins at 'c', which is not a part or list of 'whole'; there are a, b, a.start, b.start at c.py:9"
    );
    assert_eq!(
        line("a", "enogh", "b"),
        "UnknownName: the transition ('a', 'enogh') → 'b' names the condition 'enogh', which part 'a' (verb 'first') does not have; did you mean 'enough'? at c.py:9"
    );
    assert_eq!(
        line("a", "enough", "b.back"),
        "UnknownName: the transition ('a', 'enough') → 'b.back' leads to 'b.back', which is not a part or list of 'whole'; there are a, b, a.start, b.start at c.py:9"
    );
    assert_eq!(
        refused(plain(), plain(), json!({"initial": "c"})),
        "UnknownName: initial= names 'c', which is not a part or list of 'whole'; there are a, b, a.start, b.start at c.py:9"
    );
    let own = json!({"command_lists": {"start": list(&["+s 1ms"]), "back": list(&["+s 2ms"])}, "initial": "start", "transitions": [{"from": "start", "condition": "enough", "to": "back"}]});
    assert_eq!(
        refused(own, plain(), json!({"transitions": [{"from": "a.start", "condition": "enough", "to": "b"}]})),
        "CompositionConflict: the transition ('a.start', 'enough') → 'b' changes nothing: 'enough' does not end 'a.start' of part 'a' (verb 'first'): in 'a.start' it already leads to 'a.back'; leave the line out, or name a list that it ends at c.py:9"
    );
    assert_eq!(
        refused(plain(), plain(), json!({"transitions": [{"from": "a", "condition": "enough", "to": "b"}, {"from": "a", "condition": "enough", "to": "a"}]})),
        "CompositionConflict: the transition ('a', 'enough') → 'a' appears twice: ('a.start', 'enough') leads to two lists; let a condition lead from a list to only one list at c.py:9"
    );
    assert_eq!(
        refused(plain(), plain(), json!({"transitions": []})),
        "CompositionConflict: nothing leads from 'a.start' to part 'b' (verb 'second'); add a line to transitions, for example ('a', 'completed'): 'b' at c.py:9"
    );
}

#[test]
fn a_line_that_would_lead_from_an_ending_back_to_work_is_refused() {
    let slows = || {
        json!({"command_lists": {"start": list(&["+s 1ms"]), "stop": list(&["+s 2ms"])}, "initial": "start",
            "transitions": [{"from": "start", "condition": "halted", "to": "stop"}],
            "conditions": {"enough": {"on": ["s.above"], "returns": ["last"], "during": ["start"]}, "rests": {"on": ["s.above"], "during": ["stop"]}}})
    };
    let lines = |more: Value| {
        let mut lines = vec![json!({"from": "a", "condition": "enough", "to": "b"})];
        lines.extend(more.as_array().expect("lines").iter().cloned());
        refused(slows(), plain(), json!({"transitions": lines}))
    };
    assert_eq!(
        lines(json!([{"from": "a", "condition": "rests", "to": "b"}])),
        "CompositionConflict: the transition ('a', 'rests') → 'b' is never taken: 'a.stop' follows 'halted', which tells the verb to end, so 'rests' ends it there and 'b.start' does not begin; leave the line out, or name what tells the verb to end, if 'b' is how it ends: ('a', 'halted') at c.py:9"
    );
    assert_eq!(lines(json!([{"from": "b", "condition": "halted", "to": "a.stop"}])), "", "a list of ending may be shared");
    assert_eq!(lines(json!([{"from": "a", "to": "b"}])), "", "every normal end leads on from the others");
    let parks = json!({"transitions": [{"from": "a", "condition": "rests", "to": "b"}]});
    assert_eq!(refused(slows(), plain(), parks), "", "what is reached in this way alone is no work");
}

#[test]
fn a_part_finds_what_it_needs_when_it_begins() {
    let goal = |name: &str, input: &str| {
        one(name, "lib.relaxed", "1ms", json!({"instantiation_parameters": {"u": ["b.u"]}, "input_parameters": {input: {"targets": ["b.u"]}}}))
    };
    assert_eq!(
        refused_of(goal("first", "one"), goal("second", "two"), plain()),
        "CompositionConflict: the inputs 'one' and 'two' of part 'a' and part 'b' are both stored in 'u' at the start; give them one name with rename=, or give each its own object at c.py:9"
    );
    assert_eq!(
        refused_of(goal("first", "one"), goal("second", "one"), json!({"preset": {"b.one": 3}})),
        "CompositionConflict: the inputs 'one' and 'b.one' of part 'a' and part 'b' are both stored in 'u' at the start; give them one name with rename=, or give each its own object at c.py:9"
    );
    assert_eq!(
        refused_of(part("first", plain()), goal("second", "two"), json!({"rename": {"b.u": "y"}})),
        "CompositionConflict: the input 'two' of part 'b' is stored in 'y' (input 'b.b.u' (double)) at the start, but output 'a.s.y' (double) overwrites it before that part begins; give the input its own cell, or rename the parameter of one part at c.py:9"
    );
    let reader = |every: &str, modes: Value| one("second", "lib.gain", every, json!({"instantiation_parameters": {"y": ["b.u"]}, "modes": modes}));
    assert_eq!(
        refused_of(part("first", plain()), reader("", json!({})), plain()),
        "SchedulingError: input 'b.b.u' (double) of part 'b' waits for values of 'y', which output 'a.s.y' (double) writes, but only while part 'a' runs; relax the input in verb 'second' with modes={'b.u': 'asynchronous'}, or share the block that writes at c.py:9"
    );
    assert_eq!(refused_of(part("first", plain()), reader("1ms", json!({"b.u": "asynchronous"})), plain()), "");
}

#[test]
fn parts_that_run_together_do_not_write_wait_or_end_against_each_other() {
    let together = |a: Value, b: Value, rename: Value| refused(a, b, json!({"together": true, "transitions": [], "rename": rename}));
    let apart = || json!({"b.y": "z", "b.last": "z_last"});
    let waits = json!({"command_lists": start(&["+s 1ms", "?s.above", "-s"])});
    let own = json!({"command_lists": {"start": list(&["+s 1ms"]), "back": list(&["+s 2ms"])}, "initial": "start", "transitions": [{"from": "start", "condition": "enough", "to": "back"}]});
    assert_eq!(
        together(plain(), plain(), json!({})),
        "SecondWriter: 'y' has two writers at the same time: output 'a.s.y' (double) and output 'b.s.y' (double); rename one: rename={'b.y': 'b_y'}, or let one follow the other at c.py:9\n\
         CompositionConflict: the condition 'enough' returns the output 'last' of part 'a' and part 'b', and both run together; rename one: rename={'b.last': 'b_last'} at c.py:9"
    );
    assert_eq!(
        together(waits.clone(), waits, apart()),
        "CompositionConflict: the initial lists of part 'a' and part 'b' cannot be merged: both wait, but one list waits for only one thing at a time; let τ of one of them do the work of its wait at c.py:9"
    );
    assert_eq!(
        together(json!({"conditions": {"enough": {"priority": 2}}}), plain(), apart()),
        "CompositionConflict: the condition 'enough' has priority 2 and 0 in part 'a' and part 'b', and both run together; rename one: rename={'b.enough': '…'}, or make them alike at c.py:9"
    );
    assert_eq!(
        together(json!({"conditions": {"enough": {"raises": true}}}), plain(), apart()),
        "CompositionConflict: the condition 'enough' of part 'a' and part 'b' is a normal end in one but not in the other, and both run together; rename one: rename={'b.enough': '…'}, or make them alike at c.py:9"
    );
    assert_eq!(
        together(own.clone(), own, apart()),
        "CompositionConflict: in the list 'start', the condition 'enough' leads part 'a' and part 'b' to different lists; rename one: rename={'b.enough': 'b_enough'} at c.py:9"
    );
    assert_eq!(
        refused(plain(), json!({"command_lists": start(&["+s 2ms"])}), json!({"together": true, "transitions": [], "share": ["s"]})),
        "SchedulingError: part 'a' and part 'b' activate the shared block 's' differently; give it one interval and budget at c.py:9"
    );
}

#[test]
fn parts_that_are_all_awaited_come_to_an_end_in_one_list() {
    let all = |a: Value| refused(a, plain(), json!({"together": true, "until": "all", "transitions": [], "rename": {"b.y": "z", "b.last": "z_last"}}));
    let lists = json!({"start": list(&["+s 1ms"]), "back": list(&["+s 2ms"])});
    let goes_on = json!([{"from": "start", "condition": "enough", "to": "back"}]);
    assert_eq!(
        all(json!({"command_lists": lists, "initial": "start", "transitions": goes_on})),
        "CompositionConflict: all parts are awaited in 'start', but part 'a' (verb 'first') proceeds to its list 'back' on 'enough'; compose it so that it needs only one list, or leave until='all' out at c.py:9"
    );
    assert_eq!(
        all(json!({"conditions": {"enough": {"raises": true}}})),
        "CompositionConflict: all parts are awaited, but part 'a' (verb 'first') has no condition with returns= that ends its list 'start'; give it one: conditions={'arrived': on('near.done', returns=[])} at c.py:9"
    );
}

#[test]
fn a_system_condition_that_leads_only_one_part_back_is_refused_with_a_remedy_that_holds() {
    let stopping = |condition: &str, to: &str| {
        let mut lists = json!({"start": list(&["+s 1ms"]), "stop": list(&["+s 2ms"])});
        lists[to] = list(&["+s 2ms"]);
        let mut transitions = vec![json!({"from": "start", "condition": "halted", "to": "stop"})];
        transitions.push(json!({"from": "start", "condition": condition, "to": to}));
        json!({"command_lists": lists, "initial": "start", "transitions": transitions})
    };
    let together = |condition: &str, a: &str, b: &str| {
        let rename = json!({"b.y": "z", "b.last": "z_last", "b.enough": "z_enough"});
        refused(stopping(condition, a), stopping(condition, b), json!({"together": true, "transitions": [], "rename": rename}))
    };
    assert_eq!((together("time_limit", "stop", "start"), together("device_lost", "start", "give_up")), (String::new(), String::new()));
    for condition in ["completed", "overrun", "fault"] {
        let said = together(condition, "stop", "start");
        assert!(said.contains(&format!("the condition '{condition}' leads part 'a' and part 'b' to different lists")), "{said}");
        assert!(said.contains("let it lead both back to the initial list, or both to other lists") && !said.contains("rename"), "{said}");
        for (a, b) in [("start", "start"), ("stop", "stop"), ("give_up", "give_up"), ("stop", "give_up")] {
            assert_eq!(together(condition, a, b), String::new(), "the remedy holds");
        }
    }
}
