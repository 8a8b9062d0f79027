// SPDX-License-Identifier: Apache-2.0
//! Scenarios: ending lists, and the transitions of τ on a halt, an abort and a disabled device.
use crate::common::*;
use model::refusal::Class;
use serde_json::{Value as Json, json};
use supervisor::Limits;

/// Returns a verb that counts into SVV `a` every ms; its list `release` counts into `b` three times at every end.
fn braked(name: &str, rest: Json) -> Json {
    let mut of = verb(
        name,
        &[("count", "t.count"), ("brake", "t.count"), ("bad", "t.faulty")],
        json!({"instantiation_parameters": {"a": ["count.y"], "b": ["brake.y"]}, "cells": {"ct": ["count.total"], "bt": ["brake.total"], "bad": ["bad.y"]},
               "input_parameters": {"limit": {"targets": ["count.limit"], "default": 0.0}, "closed": {"targets": ["brake.limit"], "default": 0.0}},
               "output_values": {"y": "count.y"},
               "conditions": {"reached": {"on": ["count.reached"], "returns": ["y"]}, "closed": {"on": ["brake.reached"], "during": "release"}, "halted": {"returns": ["y"]}},
               "command_lists": lists(&[("go", &["+count 1ms"]), ("release", &["+brake 1ms", "?3.5ms", "-brake"])]),
               "initial": "go", "ending": "release"}),
    );
    for (key, value) in rest.as_object().unwrap() {
        of[key] = value.clone();
    }
    of
}

const PLACES: [&[&str]; 3] = [
    &["a=a", "b=b", "*@rtp0.fast"],
    &["a=a", "b=b", "count@rtp0.fast", "brake@rtp1.other", "bad@rtp1.other"],
    &["a=a", "b=b", "count@rtp1.other", "brake@rtp0.fast", "bad@rtp1.other"],
];

/// Runs a scenario with the verb in one source and across two.
fn everywhere(of: Json, scenario: impl Fn(&Rig, u64)) {
    for place in PLACES {
        on_all(|rig| {
            rig.svvs(&["a", "b"]);
            rig.define(of.clone());
            scenario(rig, rig.instance(of["name"].as_str().unwrap(), place));
        });
    }
}

/// Checks that the ending list has run for `ms` milliseconds: one firing more if its source fires later in the instant at which it began.
fn braked_times(rig: &Rig, ms: f64) {
    let counted = rig.read("b");
    assert!((ms..=ms + 1.0).contains(&counted), "it ran {counted} times");
}

#[test]
fn the_ending_list_runs_after_a_condition_which_the_report_names_with_its_outputs() {
    everywhere(braked("v", json!({})), |rig, id| {
        for start in 1..=2 {
            let before = rig.system.now_ns();
            rig.start_with(id, json!({"limit": 4.0}));
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), report.command_list.as_str(), report.normal, report.start), ("reached", "go", true, start));
            assert_eq!(output(&report, "y"), 4.0, "read when the condition came");
            assert_eq!(rig.read("a"), 4.0);
            braked_times(rig, 3.0);
            assert_eq!((report.others.len(), (rig.system.now_ns() - before) / MS), (0, 7));
            rig.align();
        }
        assert_eq!(rig.logged("end").len(), 2);
    });
}

#[test]
fn the_ending_list_runs_at_a_halt_a_fault_a_limit_and_completion() {
    let mut faults = braked("faults", json!({}));
    faults["command_lists"]["go"] = list(&["+count 1ms", "+bad 1ms"]);
    let mut through = braked("through", json!({}));
    through["command_lists"]["go"] = list(&["+count 1ms", "?4.5ms", "-count"]);
    for (of, condition) in [(braked("halts", json!({})), "halted"), (faults, "fault"), (braked("limited", json!({})), "time_limit"), (through, "completed")] {
        everywhere(of, |rig, id| {
            let limits = Limits { time_limit_ns: (condition == "time_limit").then_some(4_500_000), overruns: None, age_max_ns: None };
            rig.try_start(id, json!({}), limits).unwrap();
            if condition == "halted" {
                rig.advance(4);
                rig.system.halt(id).unwrap();
            }
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), rig.read("a")), (condition, 4.0));
            braked_times(rig, 3.0);
            if condition == "halted" {
                assert_eq!(output(&report, "y"), 4.0);
            }
        });
    }
}

#[test]
fn a_second_halt_and_an_emergency_stop_do_not_wait_for_the_ending_list() {
    everywhere(braked("v", json!({})), |rig, id| {
        rig.start(id);
        rig.advance(2);
        rig.system.halt(id).unwrap();
        rig.advance(1);
        assert_eq!(rig.system.state(id), "running");
        assert_eq!(class(rig.system.suspend(id)), Class::InvalidState);
        rig.system.halt(id).unwrap();
        let report = rig.wait_for(id, 0).expect("it ends at once");
        assert_eq!((report.condition.as_str(), output(&report, "y"), rig.read("b")), ("halted", 2.0, 1.0));
        rig.start(id);
        rig.advance(2);
        rig.system.emergency_stop("tested").unwrap();
        assert_eq!(rig.wait_for(id, 0).unwrap().condition, "emergency_stop");
        assert_eq!(rig.read("b"), 1.0);
        rig.system.reset().unwrap();
        rig.start_with(id, json!({"limit": 2.0}));
        rig.advance(3);
        rig.system.emergency_stop("tested").unwrap();
        let report = rig.wait_for(id, 0).unwrap();
        assert_eq!((report.condition.as_str(), report.others[0].condition.as_str()), ("reached", "emergency_stop"), "it was ending already");
    });
}

#[test]
fn a_condition_in_the_ending_list_ends_it_and_its_limit_cuts_it_short() {
    everywhere(braked("v", json!({"ending_limit_ns": 2_500_000})), |rig, id| {
        rig.start_with(id, json!({"limit": 2.0, "closed": 1.0}));
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.others[0].condition.as_str(), rig.read("b")), ("reached", "closed", 1.0));
        rig.align();
        rig.start_with(id, json!({"limit": 2.0}));
        let report = rig.wait(id);
        assert_eq!(report.condition, "reached");
        braked_times(rig, 2.0);
        assert!(report.message.contains("'release' was cut short after 0.0025 s"), "{}", report.message);
    });
}

#[test]
fn what_a_transition_on_a_halt_leads_to_reports_halted_and_then_the_ending_list_runs() {
    let mut of = braked("v", json!({"transitions": tau(&["go, halted -> slow", "slow, fault -> stuck"])}));
    of["command_lists"]["slow"] = list(&["+count 2ms", "?4.5ms", "-count"]);
    of["command_lists"]["stuck"] = list(&["+bad 1ms"]);
    everywhere(of, |rig, id| {
        rig.start(id);
        rig.advance(2);
        rig.system.halt(id).unwrap();
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.command_list.as_str(), report.normal), ("halted", "slow", true));
        assert_eq!(output(&report, "y"), 4.0);
        braked_times(rig, 3.0);
        rig.align();
        rig.start_with(id, json!({"limit": 3.0}));
        rig.advance(2);
        rig.system.halt(id).unwrap();
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), output(&report, "y")), ("halted", 3.0), "a normal end on the way is the halt's");
        braked_times(rig, 3.0);
        assert_eq!(report.others[0].condition, "reached");
    });
}

#[test]
fn a_suspended_instance_that_is_halted_takes_its_transition_and_its_ending_list() {
    let mut of = braked("v", json!({"transitions": tau(&["go, halted -> slow"])}));
    of["command_lists"]["slow"] = list(&["+count 1ms", "?2.5ms", "-count"]);
    everywhere(of, |rig, id| {
        rig.start(id);
        rig.advance(3);
        rig.system.suspend(id).unwrap();
        rig.advance(7);
        rig.system.halt(id).unwrap();
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.command_list.as_str()), ("halted", "slow"));
        assert_eq!(output(&report, "y"), 5.0);
        braked_times(rig, 3.0);
    });
    everywhere(braked("w", json!({})), |rig, id| {
        rig.start(id);
        rig.advance(3);
        rig.system.suspend(id).unwrap();
        rig.advance(7);
        rig.system.halt(id).unwrap();
        assert_eq!(output(&rig.wait(id), "y"), 3.0);
        braked_times(rig, 3.0);
    });
}

#[test]
fn a_transition_of_a_list_to_itself_is_in_the_log() {
    on_both(|rig| {
        rig.define(verb(
            "v",
            &[("a", "t.count")],
            json!({"cells": {"y": ["a.y"], "t": ["a.total"]}, "input_parameters": {"limit": {"targets": ["a.limit"], "default": 3.0}},
                   "conditions": {"reached": {"on": ["a.reached"]}}, "initial": "one", "command_lists": lists(&[("one", &["*a", "+a 1ms"])]),
                   "transitions": tau(&["one, reached -> one"])}),
        ));
        let id = rig.instance("v", &["*@rtp0.fast"]);
        rig.start(id);
        rig.advance(7);
        assert_eq!(rig.logged("transition"), ["v#1: command list 'one' after 'one'", "v#1: command list 'one' after 'one'"]);
    });
}

#[test]
fn an_ending_list_that_cannot_be_is_refused() {
    let rig = Rig::new(Link::Memory);
    rig.svvs(&["a", "b"]);
    let refused = |rest: Json, class: Class, words: &str| {
        let refusals = rig.try_define(braked("v", rest)).unwrap_err();
        assert!(refusals.iter().any(|r| r.class == class && r.message.contains(words)), "{}", text(&refusals));
    };
    refused(json!({"ending": "relase"}), Class::UnknownName, "the ending list 'relase' of verb 'v' does not exist");
    refused(json!({"ending": "go"}), Class::DefinitionError, "is also its initial one");
    refused(json!({"transitions": tau(&["go, halted -> release"])}), Class::DefinitionError, "enters the ending list");
    refused(json!({"transitions": tau(&["release, completed -> go"])}), Class::DefinitionError, "leaves the ending list");
    refused(json!({"ending_limit_ns": 0}), Class::DefinitionError, "an ending limit of 0 ns");
    let mut alone = braked("alone", json!({}));
    alone["initial"] = Json::Null;
    rig.define(alone);
}

#[test]
fn a_source_that_does_not_answer_is_a_lost_processor_for_the_verbs_there_and_for_nobody_else() {
    on_both(|rig| {
        rig.svvs(&["a", "b", "c"]);
        rig.define(braked("v", json!({})));
        let there = rig.create(json!({"verb": "v", "name": "there", "arguments": {"a": {"svv": "a"}, "b": {"svv": "b"}},
            "placement": {"count": "rtp0.fast", "*": "rtp1.other"}}));
        rig.define(verb(
            "w",
            &[("count", "t.count")],
            json!({"instantiation_parameters": {"c": ["count.y"]}, "cells": {"t": ["count.total"]},
            "command_lists": lists(&[("go", &["+count 1ms"])])}),
        ));
        let here = rig.instance("w", &["c=c", "*@rtp0.fast"]);
        rig.start(there);
        rig.start(here);
        rig.advance(2);
        rig.system.cut_off("rtp1.other").unwrap();
        rig.advance(10_000);
        assert_eq!((rig.system.state(there), rig.system.state(here)), ("running", "running"), "nobody asked it anything");
        let before = rig.system.now_ns();
        rig.system.halt(there).unwrap();
        let report = rig.wait(there);
        assert_eq!((report.condition.as_str(), report.normal), ("halted", true), "the halt came first, and is cut short");
        assert_eq!(report.others[0].condition, "processor_lost");
        assert_eq!(rig.system.now_ns() - before, 5_000 * MS);
        assert_eq!(rig.logged("processor_lost"), ["rtp1.other: source 'rtp1.other' has not answered for 5 s"]);
        assert_eq!(class(rig.try_start(there, json!({}), Limits::default())), Class::InvalidState);
        assert_eq!(rig.system.state(here), "running");
        rig.system.halt(here).unwrap();
        assert_eq!(rig.wait_for(here, 0).unwrap().condition, "halted");
        assert_eq!(class(rig.system.cut_off("rtp1.othre")), Class::UnknownName);
    });
}

#[test]
fn a_source_may_be_busy_for_as_long_as_a_declared_budget_allows() {
    let mut of = braked("v", json!({"ending_limit_ns": 60_000 * MS}));
    of["command_lists"]["go"]["commands"][0]["budget_ns"] = json!(30_000 * MS);
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(of.clone());
        let id = rig.instance("v", &["a=a", "b=b", "count@rtp1.other", "*@rtp0.fast"]);
        rig.start(id);
        rig.advance(2);
        rig.system.cut_off("rtp1.other").unwrap();
        let before = rig.system.now_ns();
        rig.system.halt(id).unwrap();
        let report = rig.wait(id);
        assert_eq!(report.others[0].condition, "processor_lost");
        assert_eq!(rig.system.now_ns() - before, 35_000 * MS);
        assert_eq!(rig.logged("processor_lost"), ["rtp1.other: source 'rtp1.other' has not answered for 35 s"]);
    });
}

#[test]
fn a_source_that_is_lost_while_a_verb_goes_on_ends_it_with_that_condition() {
    let mut of = braked("v", json!({"transitions": tau(&["go, reached -> there"])}));
    of["command_lists"]["there"] = list(&["+bad 1ms"]);
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(of.clone());
        let id = rig.instance("v", &["a=a", "b=b", "count@rtp0.fast", "brake@rtp0.fast", "bad@rtp1.other"]);
        rig.start_with(id, json!({"limit": 3.0}));
        rig.advance(1);
        rig.system.cut_off("rtp1.other").unwrap();
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.normal, rig.read("b")), ("processor_lost", false, 0.0));
        assert!(report.message.contains("'rtp1.other' has not answered"), "{}", report.message);
    });
}

#[test]
fn disabling_waits_for_what_its_users_and_its_own_verb_do_at_their_ends() {
    on_both(|rig| {
        rig.define(verb(
            "keeper",
            &[("count", "t.count")],
            json!({"instantiation_parameters": {"n": ["count.y"]}, "cells": {"t": ["count.total"]}, "initial": "start", "ending": "brake",
                   "command_lists": lists(&[("start", &["+count 1ms", "ready"]), ("brake", &["+count 1ms", "?2.5ms", "-count"])])}),
        ));
        rig.device_type(json!({"name": "Kept", "verb": "keeper", "svvs": {"n": {"type_text": "double"}, "commanded": {"type_text": "double"}}}));
        rig.system.device("d", serde_json::from_value(json!({"device_type": "Kept", "source": "rtp0.fast"})).unwrap()).unwrap();
        rig.define(verb(
            "user",
            &[("count", "t.count")],
            json!({"objects": {"d": {"device_type": "Kept"}}, "instantiation_parameters": {"d.commanded": ["count.y"]}, "cells": {"t": ["count.total"]}, "initial": "go",
                   "command_lists": lists(&[("go", &["+count 1ms"]), ("slow", &["+count 2ms", "?3.5ms", "-count"]), ("again", &["+count 1ms"])]),
                   "transitions": tau(&["go, device_disabled -> slow", "slow, device_disabled -> again"])}),
        ));
        let id = rig.create(json!({"verb": "user", "name": "user", "arguments": {"d": {"device": "d"}}, "placement": {"*": "rtp1.other"}}));
        rig.system.enable("d").unwrap();
        rig.advance(1);
        rig.start(id);
        rig.advance(3);
        let before = rig.system.now_ns();
        let disabled = rig.system.disable("d", std::time::Duration::from_secs(60));
        assert!(matches!(disabled, Ok(supervisor::WaitResult::Done(()))) && rig.system.device_state("d").unwrap() == "disabled");
        assert_eq!(rig.system.now_ns() - before, 6 * MS);
        assert_eq!(rig.wait(id).command_list, "slow", "it is told once that its device is disabled");
        let ends: Vec<String> = rig.logged("end").iter().map(|e| e.split(": ").take(2).collect::<Vec<_>>().join(": ")).collect();
        assert_eq!(ends, ["user: device_disabled", "d.keeper: device_disabled"]);
    });
}

#[test]
fn a_list_that_overtakes_a_start_has_the_values_of_that_start() {
    // A firing of 400 us of the source that reads the SVV delays the tables that the start needs first.
    let rig = Rig::begun(runtime::ClockKind::Virtual { seed: 3 }, Link::Memory, 400_000, |_| {});
    rig.svvs(&["x"]);
    rig.define(verb(
        "v",
        &[("first", "t.count"), ("then", "t.count")],
        json!({"instantiation_parameters": {"x": ["first.y"]}, "cells": {"y": ["then.y"], "t": ["first.total"], "u": ["then.total"]},
               "input_parameters": {"begin": {"targets": ["then.start"]}}, "output_values": {"y": "then.y"},
               "initial": "one", "transitions": tau(&["one, halted -> two"]), "conditions": {"halted": {"returns": ["y"]}, "completed": {"returns": ["y"]}},
               "command_lists": lists(&[("one", &["+first 1ms"]), ("two", &["+then 1ms", "?3ms", "-then"])])}),
    ));
    let ids = [rig.instance("v", &["x=x", "*@rtp1.other"]), rig.instance("v", &["x=x", "first@rtp0.fast", "then@rtp1.other"])];
    // The home of the SVV moves from one source to the other and back.
    for round in 0..4 {
        let (id, from) = (ids[round % 2], 100.0 * (round + 1) as f64);
        rig.align();
        rig.system.advance(1_100_000).unwrap();
        rig.start_with(id, json!({"begin": from}));
        rig.system.halt(id).unwrap();
        let report = rig.wait(id);
        assert!((from..from + 10.0).contains(&output(&report, "y")), "{from}: {report:?}");
    }
}
