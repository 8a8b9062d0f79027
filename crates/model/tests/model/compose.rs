// SPDX-License-Identifier: Apache-2.0
//! Compositions: the contents of the resulting verb.
use crate::common::*;
use model::Composition;
use model::definition::{Command, Verb};
use model::plan::InputOrigin;
use model::refusal::Refusals;
use serde_json::{Value, json};

/// Returns a verb that reports `enough` when its signal is above `limit`.
fn counting(name: &str, rest: Value) -> Value {
    let mut counting = verb(
        &[("s", "lib.signal")],
        json!({"name": name, "instantiation_parameters": {"y": ["s.y"]}, "input_parameters": {"limit": {"targets": ["s.above"], "default": 3.0}},
            "output_values": {"last": "s.y"}, "command_lists": start(&["+s 1ms"]), "conditions": {"enough": {"on": ["s.above"], "returns": ["last"]}}}),
    );
    merge(&mut counting, rest);
    counting
}

/// Returns a verb that moves to its own list `back` on `enough`, and ends there.
fn retreating(name: &str) -> Value {
    let lists = json!({"start": list(&["+s 1ms"]), "back": list(&["+s 2ms"])});
    let transitions = json!([{"from": "start", "condition": "enough", "to": "back"}]);
    counting(name, json!({"command_lists": lists, "initial": "start", "transitions": transitions}))
}

fn composed(rest: Value) -> Result<Verb, Refusals> {
    let mut whole = json!({"name": "whole", "parts": {"a": counting("first", json!({})), "b": counting("second", json!({}))},
        "transitions": [{"from": "a", "condition": "enough", "to": "b"}], "place": {"file": "c.py", "line": 9}});
    for (label, part) in rest["parts"].as_object().into_iter().flatten() {
        whole["parts"][label] = part.clone();
    }
    merge(&mut whole, rest);
    let whole: Composition = serde_json::from_value(whole).expect("a composition");
    model::compose(&whole, &cell())
}

fn made(rest: Value) -> Verb {
    composed(rest).unwrap_or_else(|refusals| panic!("{}", texts(&refusals)))
}

/// Formats τ as lines `from condition to`.
fn tau(verb: &Verb) -> Vec<String> {
    verb.transitions.iter().map(|t| format!("{} {} {}", t.from, t.condition, t.to)).collect()
}

fn keys<T>(map: &indexmap::IndexMap<String, T>) -> Vec<&str> {
    map.keys().map(String::as_str).collect()
}

#[test]
fn a_composition_is_the_union_of_its_parts_and_an_augmented_tau() {
    let whole = made(json!({}));
    assert_eq!(keys(&whole.blocks), ["a.s", "b.s"]);
    assert_eq!(keys(&whole.command_lists), ["a.start", "b.start"]);
    assert_eq!(whole.initial.as_deref(), Some("a.start"));
    assert_eq!(whole.instantiation_parameters["y"], ["a.s.y", "b.s.y"]);
    assert_eq!(whole.input_parameters["limit"].targets, ["a.s.above", "b.s.above"]);
    assert_eq!(keys(&whole.conditions), ["a.enough", "b.enough"]);
    assert_eq!((whole.conditions["b.enough"].on[0].as_str(), &whole.conditions["b.enough"].during[..]), ("b.s.above", &["b.start".to_owned()][..]));
    assert_eq!(whole.output_values["b.last"], "b.s.y");
    assert_eq!(tau(&whole), ["a.start enough b.start"]);
    assert_eq!(whole.parts["b"].verb, "second");
}

#[test]
fn it_applies_like_any_verb_and_each_part_ends_by_its_own_line() {
    let verb = serde_json::to_value(made(json!({}))).expect("a verb");
    let plan = apply_json(verb, json!({"arguments": {"y": {"svv": "a"}}})).unwrap_or_else(|refusals| panic!("{}", texts(&refusals)));
    let lines: Vec<(&str, Vec<usize>, Vec<&str>)> = (plan.conditions.iter())
        .filter(|c| c.name == "enough")
        .map(|c| (plan.blocks[c.on[0].0].label.as_str(), c.during.clone(), c.returns.iter().map(|o| plan.outputs[*o].name.as_str()).collect()))
        .collect();
    assert_eq!(lines, [("a.s", vec![0], vec!["last"]), ("b.s", vec![1], vec!["last"])]);
    let of = |list: usize| plan.lists[list].transitions.iter().map(|(c, to)| (plan.conditions[*c].name.as_str(), *to)).collect::<Vec<_>>();
    assert_eq!((of(0), of(1)), (vec![("enough", 1)], vec![]));
    assert!(plan.conditions.iter().any(|c| c.name == "completed" && c.during.is_empty()));
}

#[test]
fn a_system_condition_that_one_part_names_has_its_own_line_in_the_others() {
    let a = counting("first", json!({"conditions": {"completed": {"returns": ["last"]}}}));
    let verb = serde_json::to_value(made(json!({"parts": {"a": a}}))).expect("a verb");
    let plan = apply_json(verb, json!({"arguments": {"y": {"svv": "a"}}})).expect("a plan");
    let completed: Vec<(usize, Vec<usize>)> = plan.conditions.iter().filter(|c| c.name == "completed").map(|c| (c.returns.len(), c.during.clone())).collect();
    assert_eq!(completed, [(1, vec![0]), (0, vec![1])]);
}

#[test]
fn a_part_as_origin_is_every_list_that_the_condition_ends() {
    let whole = made(json!({"parts": {"a": retreating("first")}}));
    assert_eq!(tau(&whole), ["a.start enough a.back", "a.back enough b.start"], "what the part does itself stays");
}

#[test]
fn a_line_for_a_list_counts_before_one_for_the_part_and_that_before_every_normal_end() {
    let a = counting("first", json!({"conditions": {"completed": {"returns": ["last"]}}}));
    let c = counting("third", json!({}));
    let lines = json!([{"from": "a", "to": "b"}, {"from": "a", "condition": "completed", "to": "c"}, {"from": "a.start", "condition": "enough", "to": "c"},
        {"from": ["a", "c"], "condition": "enough", "to": "b"}]);
    let whole = made(json!({"parts": {"a": a, "c": c}, "transitions": lines}));
    assert_eq!(tau(&whole), ["a.start enough c.start", "a.start completed c.start", "c.start enough b.start"]);
}

#[test]
fn every_normal_end_is_what_returns_and_does_not_raise() {
    let a = counting("first", json!({"conditions": {"bad": {"on": ["s.above"], "raises": true}, "halted": {"returns": ["last"]}}}));
    let whole = made(json!({"parts": {"a": a}, "transitions": [{"from": "a", "to": "b"}]}));
    assert_eq!(tau(&whole), ["a.start enough b.start", "a.start completed b.start"]);
}

#[test]
fn a_composed_verb_composes_again() {
    let inner = serde_json::to_value(made(json!({"rename": {"b.enough": "full"}}))).expect("a verb");
    let c = counting("third", json!({}));
    let whole = made(
        json!({"parts": {"a": inner, "b": c}, "transitions": [{"from": "a.b", "condition": "full", "to": "b"}, {"from": "b", "condition": "enough", "to": "a.a"}]}),
    );
    assert_eq!(keys(&whole.blocks), ["a.a.s", "a.b.s", "b.s"]);
    assert_eq!(keys(&whole.conditions), ["a.a.enough", "a.b.full", "b.enough"]);
    assert_eq!(tau(&whole), ["a.a.start enough a.b.start", "a.b.start full b.start", "b.start enough a.a.start"]);
    assert_eq!(keys(&whole.parts), ["a", "a.a", "a.b", "b"]);
    assert_eq!(whole.instantiation_parameters["y"], ["a.a.s.y", "a.b.s.y", "b.s.y"]);
}

#[test]
fn renamed_things_stay_apart_and_a_preset_is_no_parameter() {
    let whole = made(json!({"rename": {"b.y": "z", "b.last": "last_b", "b.enough": "full"}, "preset": {"b.limit": 7}}));
    assert_eq!(keys(&whole.instantiation_parameters), ["y", "z"]);
    assert_eq!(keys(&whole.output_values), ["a.last", "b.last_b"]);
    assert_eq!((whole.conditions["b.full"].returns.clone(), whole.reported("b.full")), (Some(vec!["b.last_b".to_owned()]), "full"));
    assert_eq!((whole.input_parameters["limit"].targets.len(), whole.input_parameters["b.limit"].preset), (1, true));
    let plan = apply_json(serde_json::to_value(&whole).expect("a verb"), json!({"arguments": {"y": {"svv": "a"}, "z": {"svv": "b"}}})).expect("a plan");
    let origins: Vec<(&str, &InputOrigin)> = plan.inputs.iter().map(|i| (i.name.as_str(), &i.origin)).collect();
    assert_eq!(origins, [("limit", &InputOrigin::Given), ("b.limit", &InputOrigin::Preset)]);
}

#[test]
fn an_input_is_optional_where_it_is_so_in_all_parts() {
    let b = counting("second", json!({"input_parameters": {"limit": {"default": null, "tunable": true}}}));
    let whole = made(json!({"parts": {"b": b}}));
    assert_eq!((whole.input_parameters["limit"].default.clone(), whole.input_parameters["limit"].tunable), (None, false));
}

/// Returns a chain `s → c → k`, whose wire is the cell `w`.
fn chain(name: &str, rest: Value) -> Value {
    let mut chain = verb(
        &[("c", "lib.constant"), ("k", "lib.gain"), ("s", "lib.signal")],
        json!({"name": name, "cells": {"w": ["c.y", "k.u"], "v": ["s.y", "c.u"]}, "command_lists": start(&["+s 1ms", "+c", "+k"]),
            "conditions": {"over": {"on": ["s.above"], "returns": []}}}),
    );
    merge(&mut chain, rest);
    chain
}

#[test]
fn a_shared_block_is_one_instance_with_its_cells() {
    let parts = json!({"a": chain("first", json!({})), "b": chain("second", json!({}))});
    let lines = json!([{"from": "a", "condition": "over", "to": "b"}]);
    let whole: Composition =
        serde_json::from_value(json!({"name": "whole", "parts": parts, "share": ["s", "c"], "transitions": lines})).expect("a composition");
    let whole = model::compose(&whole, &cell()).unwrap_or_else(|refusals| panic!("{}", texts(&refusals)));
    assert_eq!(keys(&whole.blocks), ["c", "a.k", "s", "b.k"]);
    assert_eq!((&whole.cells["w"][..], &whole.cells["v"][..]), (&["c.y", "a.k.u", "b.k.u"].map(str::to_owned)[..], &["s.y", "c.u"].map(str::to_owned)[..]));
    let plan = apply_json(serde_json::to_value(&whole).expect("a verb"), json!({})).unwrap_or_else(|refusals| panic!("{}", texts(&refusals)));
    let on = |list: usize| plan.lists[list].stages[0].active.iter().map(|(activation, _)| *activation).collect::<Vec<_>>();
    let shared = plan.blocks.iter().find(|b| b.label == "s").expect("it is there").activation;
    assert!(on(0).contains(&shared) && on(1).contains(&shared), "it is on in both lists, as one activation");
}

/// Formats a list in short form: `+` activates, `-` deactivates, `?` waits.
fn commands(verb: &Verb, list: &str) -> Vec<String> {
    let short = |command: &Command| match command {
        Command::Activate { block, .. } => format!("+{block}"),
        Command::Deactivate { block } => format!("-{block}"),
        Command::Wait { conditions, .. } => format!("?{}", conditions.join(" ")),
        other => format!("{other:?}"),
    };
    verb.command_lists[list].commands.iter().map(short).collect()
}

#[test]
fn until_all_waits_for_each_part_and_is_completed_then() {
    let full = json!({"conditions": {"full": {"on": ["s.above"], "returns": ["last"]}, "burst": {"on": ["s.above"], "raises": true, "priority": 1}}});
    let whole = made(
        json!({"parts": {"b": counting("second", full)}, "transitions": [], "together": true, "until": "all", "rename": {"b.y": "z", "b.last": "last_b"}}),
    );
    assert_eq!(commands(&whole, "start"), ["+a.s", "+b.s", "?a.s.above", "?b.s.above", "-a.s", "-b.s"]);
    assert_eq!(keys(&whole.conditions), ["completed", "burst"], "what raises ends the whole, as before");
    let completed = &whole.conditions["completed"];
    assert!(completed.on.is_empty() && !completed.raises && completed.during == ["start"]);
    assert_eq!(completed.returns, Some(vec!["a.last".into(), "b.last_b".into()]));
}

#[test]
fn a_system_condition_leads_parts_that_run_together_into_one_list() {
    let stopping = |name: &str| {
        let lists = json!({"start": list(&["+s 1ms"]), "stop": list(&["+s 2ms"]), "give_up": list(&["+s 2ms"])});
        let transitions = json!([{"from": "start", "condition": "halted", "to": "stop"}, {"from": "start", "condition": "time_limit", "to": "give_up"}]);
        let conditions = json!({"enough": {"on": ["s.above"], "returns": ["last"], "during": ["start"]},
            "stopped": {"on": ["s.above"], "returns": ["last"], "during": ["stop"]}, "late": {"on": ["s.above"], "raises": true, "during": ["give_up"]}});
        counting(name, json!({"command_lists": lists, "initial": "start", "transitions": transitions, "conditions": conditions}))
    };
    let parts = json!({"a": stopping("first"), "b": stopping("second")});
    let whole = made(json!({"parts": parts, "transitions": [], "together": true, "rename": {"b.y": "z", "b.last": "last_b"}}));
    assert_eq!(keys(&whole.command_lists), ["start", "stop", "give_up"]);
    assert_eq!(tau(&whole), ["start halted stop", "start time_limit give_up"]);
    assert_eq!(commands(&whole, "start"), ["+a.s", "+b.s"], "the first that has arrived ends both");
    assert_eq!(commands(&whole, "stop"), ["+a.s", "+b.s", "?a.s.above", "?b.s.above", "-a.s", "-b.s"]);
    assert_eq!(keys(&whole.conditions), ["enough", "stop.completed", "give_up.completed"]);
    assert!(!whole.conditions["stop.completed"].raises && whole.conditions["give_up.completed"].raises);
}

#[test]
fn together_makes_one_list_of_the_initial_ones() {
    let waiting = start(&["+s 1ms", "?s.above", "-s"]);
    let b = counting("second", json!({"command_lists": waiting}));
    let whole = made(json!({"parts": {"b": b}, "transitions": [], "together": true, "rename": {"b.y": "z", "b.last": "last_b"}}));
    assert_eq!(keys(&whole.command_lists), ["start"]);
    assert_eq!(commands(&whole, "start"), ["+a.s", "+b.s", "?b.s.above", "-b.s", "-a.s"], "b is completed by that, and ends a");
    let enough = &whole.conditions["enough"];
    assert_eq!((&enough.on[..], enough.returns.clone()), (&["a.s.above", "b.s.above"].map(str::to_owned)[..], Some(vec!["a.last".into(), "b.last_b".into()])));
}

#[test]
fn together_keeps_what_each_part_does_after_it() {
    let lines = json!([{"from": "a.back", "condition": "enough", "to": "b"}]);
    let mut b = counting("second", json!({}));
    b["conditions"] = json!({"full": {"on": ["s.above"], "returns": ["last"]}});
    let whole = made(json!({"parts": {"a": retreating("first"), "b": b}, "transitions": lines, "together": true, "rename": {"b.y": "z"}}));
    assert_eq!(tau(&whole), ["start enough a.back", "a.back enough start"]);
    assert_eq!(keys(&whole.command_lists), ["start", "a.back"]);
    assert_eq!(keys(&whole.conditions), ["enough", "full", "a.enough"]);
}

#[test]
fn a_system_condition_leads_on_only_the_parts_that_follow_it() {
    let with = |name: &str, lists: Value, transitions: &[[&str; 3]]| {
        let of = |[from, condition, to]: &[&str; 3]| json!({"from": from, "condition": condition, "to": to});
        counting(name, json!({"command_lists": lists, "initial": "start", "transitions": transitions.iter().map(of).collect::<Vec<_>>()}))
    };
    // The first part works on in `back` after `enough`, and a halt leads there too; there, a halt ends it. The second one brakes.
    let back = json!({"start": list(&["+s 1ms"]), "back": list(&["+s 2ms"])});
    let mut a = with("first", back, &[["start", "enough", "back"], ["start", "halted", "back"]]);
    let stop = json!({"start": list(&["+s 1ms"]), "stop": list(&["+s 2ms"])});
    let mut b =
        with("second", stop, &[["start", "halted", "stop"], ["start", "time_limit", "stop"], ["stop", "halted", "stop"], ["stop", "time_limit", "stop"]]);
    let rename = json!({"b.y": "z", "b.enough": "full", "b.last": "z_last"});
    let whole = made(json!({"parts": {"a": &a, "b": &b}, "transitions": [], "together": true, "rename": &rename}));
    let expected = [
        "start enough a.back",
        "start halted back_and_stop",
        "start time_limit b.stop",
        "back_and_stop halted b.stop",
        "b.stop halted b.stop",
        "back_and_stop time_limit b.stop",
        "b.stop time_limit b.stop",
    ];
    assert_eq!(tau(&whole), expected);
    assert_eq!(
        (commands(&whole, "back_and_stop"), commands(&whole, "b.stop")),
        (["+a.s", "+b.s", "?a.s.above", "?b.s.above", "-a.s", "-b.s"].map(str::to_owned).to_vec(), vec!["+b.s".to_owned()])
    );
    assert_eq!(whole.conditions["b.full"].during, ["b.stop"], "the condition of the part that is left alone ends it");
    let mut sorted: Vec<String> = expected.map(str::to_owned).to_vec();
    sorted.sort();
    for turned in 0..4 {
        b["transitions"].as_array_mut().expect("transitions").rotate_left(turned);
        a["transitions"].as_array_mut().expect("transitions").reverse();
        let mut found = tau(&made(json!({"parts": {"a": &a, "b": &b}, "transitions": [], "together": true, "rename": &rename})));
        found.sort();
        assert_eq!(found, sorted, "the order of the transitions decides nothing");
    }
}

#[test]
fn a_list_that_ends_one_part_leads_to_no_work_of_that_part() {
    let of = |[from, condition, to]: [&str; 3]| json!({"from": from, "condition": condition, "to": to});
    let part = |name: &str, more: &[[&str; 3]]| {
        let mut lists = json!({"start": list(&["+s 1ms"]), "next": list(&["+s 2ms"])});
        if !more.is_empty() {
            lists["stop"] = list(&["+s 1ms"]);
        }
        let transitions: Vec<Value> = [&[["start", "completed", "next"]], more].concat().into_iter().map(of).collect();
        counting(name, json!({"command_lists": lists, "initial": "start", "transitions": transitions}))
    };
    let a = part("first", &[["start", "halted", "stop"], ["stop", "enough", "next"]]);
    let rename = json!({"b.y": "z", "b.enough": "full", "b.last": "z_last"});
    let whole = made(json!({"parts": {"a": a, "b": part("second", &[])}, "transitions": [], "together": true, "rename": rename}));
    assert_eq!(tau(&whole), ["start completed next", "start halted a.stop"]);
}

#[test]
fn a_wait_for_a_termination_condition_waits_for_what_it_stands_for_in_its_part() {
    let b = counting("second", json!({"command_lists": start(&["+s 1ms", "?enough"])}));
    let whole = made(json!({"parts": {"b": b}}));
    let Command::Wait { conditions, .. } = &whole.command_lists["b.start"].commands[1] else { panic!("a wait") };
    assert_eq!(conditions, &["b.s.above"]);
}

#[test]
fn a_part_is_placed_as_its_verb_is() {
    let mut cell = cell();
    cell.placement.insert("second.s".into(), "rtp0.fast".into());
    cell.placement.insert("second.*".into(), "rtp0.slow".into());
    let verb = serde_json::to_value(made(json!({}))).expect("a verb");
    let plan = apply_in(cell, verb, json!({"arguments": {"y": {"svv": "a"}}, "placement": {"a.s": "rtp0.fast"}, "every": {"b.s": 3_000_000}}));
    let plan = plan.unwrap_or_else(|refusals| panic!("{}", texts(&refusals)));
    let sources: Vec<&str> = plan.blocks.iter().map(|b| b.source.as_str()).collect();
    assert_eq!(sources, ["rtp0.fast", "rtp0.fast"]);
}
