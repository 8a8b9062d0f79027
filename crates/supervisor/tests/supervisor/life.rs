// SPDX-License-Identifier: Apache-2.0
//! Scenarios: the life of a verb instance. Claims, parameters, starts, suspension, halts, limits, redefinition.
use crate::common::*;
use model::refusal::Class;
use model::value::Value;
use serde_json::json;
use supervisor::Limits;

/// Returns a verb that counts into SVV `a` every ms.
fn counter(name: &str) -> serde_json::Value {
    verb(
        name,
        &[("count", "t.count")],
        json!({"instantiation_parameters": {"a": ["count.y"]}, "cells": {"t": ["count.total"]},
               "input_parameters": {"start": {"targets": ["count.start"], "default": 0.0, "tunable": true}, "limit": {"targets": ["count.limit"], "default": 0.0}},
               "output_values": {"y": "count.y", "total": "count.total"},
               "conditions": {"reached": {"on": ["count.reached"], "returns": ["y"]}, "halted": {"returns": ["y", "total"]}},
               "command_lists": lists(&[("start", &["+count 1ms"])])}),
    )
}

#[test]
fn a_start_claims_and_a_second_writer_is_refused_with_the_holders_name() {
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(counter("v"));
        let first = rig.create(json!({"verb": "v", "name": "first", "arguments": {"a": {"svv": "a"}}, "placement": {"*": "rtp0.fast"}}));
        let second = rig.instance("v", &["a=a", "*@rtp1.other"]);
        let third = rig.instance("v", &["a=b", "*@rtp1.other"]);
        rig.start(first);
        let refused = rig.try_start(second, json!({}), Limits::default()).unwrap_err();
        assert_eq!(refused[0].class, Class::SecondWriter);
        assert!(text(&refused).contains("'first'") && text(&refused).contains("SVV 'a'"), "{}", text(&refused));
        assert_eq!(rig.system.state(second), "created", "a refused start changes nothing");
        rig.start(third);
        assert_eq!(class(rig.system.write("a", &Value::Number(9.0))), Class::SecondWriter);
        rig.advance(3);
        rig.system.suspend(first).unwrap();
        assert_eq!(class(rig.try_start(second, json!({}), Limits::default())), Class::SecondWriter, "a suspended one keeps its claims");
        rig.system.halt(first).unwrap();
        assert_eq!(output(&rig.wait(first), "y"), 3.0);
        rig.write("a", 9.0);
        assert_eq!(rig.read("a"), 9.0);
        rig.start(second);
        rig.advance(2);
        assert_eq!(rig.read_all(&["a", "b"]), [2.0, 5.0]);
    });
}

#[test]
fn claims_are_all_or_none() {
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(counter("v"));
        rig.define(verb(
            "both",
            &[("a", "t.count"), ("b", "t.count")],
            json!({"instantiation_parameters": {"a": ["a.y"], "b": ["b.y"]}, "cells": {"at": ["a.total"], "bt": ["b.total"]},
                   "command_lists": lists(&[("start", &["+a 1ms", "+b 1ms"])])}),
        ));
        let holder = rig.instance("v", &["a=b", "*@rtp0.fast"]);
        let both = rig.instance("both", &["a=a", "b=b", "*@rtp0.fast"]);
        rig.start(holder);
        assert_eq!(class(rig.try_start(both, json!({}), Limits::default())), Class::SecondWriter);
        rig.write("a", 5.0);
        rig.system.halt(holder).unwrap();
        rig.wait(holder);
        rig.start(both);
        assert_eq!(class(rig.system.write("a", &Value::Number(1.0))), Class::SecondWriter);
    });
}

#[test]
fn parameters_are_stored_before_the_first_invocation_and_are_defaults_again_at_the_next_start() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        for (given, first) in [(json!({"start": 100.0}), 101.0), (json!({}), 1.0), (json!({"start": "7"}), 8.0)] {
            rig.start_with(id, given);
            rig.advance(1);
            assert_eq!(rig.read("a"), first);
            rig.system.halt(id).unwrap();
            rig.wait(id);
        }
        assert_eq!(class(rig.try_start(id, json!({"strat": 1.0}), Limits::default())), Class::CallError);
        assert_eq!(class(rig.try_start(id, json!({"start": [1.0, 2.0]}), Limits::default())), Class::ValueRefused);
        assert_eq!(rig.system.state(id), "ended");
    });
}

#[test]
fn a_tunable_parameter_changes_while_it_runs_and_only_then() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let set = |name: &str, value: f64| rig.system.set(id, &[(name.to_owned(), Value::Number(value))].into_iter().collect(), &Default::default());
        assert_eq!(class(set("start", 10.0)), Class::InvalidState);
        rig.start(id);
        rig.advance(2);
        set("start", 10.0).unwrap();
        rig.advance(1);
        assert_eq!(rig.read("a"), 13.0);
        assert_eq!(class(set("limit", 10.0)), Class::InvalidState);
    });
}

#[test]
fn the_present_values_of_inputs_are_those_of_the_start_and_of_what_was_set_since() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let inputs = || {
            let about = rig.system.instance_about(id).unwrap().inputs;
            assert_eq!(about, rig.system.installed().instances[0].inputs, "the page sees the same");
            json!(about)
        };
        let before = inputs();
        assert_eq!(before["start"], json!(0.0), "the default");
        rig.start_with(id, json!({"start": "7"}));
        assert_eq!(inputs()["start"], json!(7.0));
        let version = rig.system.installed_version();
        rig.system.set(id, &[("start".to_owned(), Value::Number(10.0))].into_iter().collect(), &Default::default()).unwrap();
        assert_eq!(inputs()["start"], json!(10.0));
        assert_ne!(rig.system.installed_version(), version, "who looks is told");
        assert_eq!(class(rig.system.set(id, &[("limit".to_owned(), Value::Number(10.0))].into_iter().collect(), &Default::default())), Class::InvalidState);
        assert_eq!(inputs()["limit"], before["limit"], "what is refused changes nothing");
        rig.system.halt(id).unwrap();
        rig.wait(id);
        assert_eq!(inputs()["start"], json!(10.0), "of its latest start");
        rig.start(id);
        assert_eq!(inputs(), before);
    });
}

#[test]
fn each_start_begins_afresh_but_for_what_is_kept() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        for n in 1..=3 {
            rig.start(id);
            rig.advance(4);
            rig.system.halt(id).unwrap();
            let report = rig.wait(id);
            assert_eq!((report.start, output(&report, "y"), output(&report, "total")), (n, 4.0, 4.0 * n as f64));
            assert!(report.normal, "a halt that was asked for is a normal end");
        }
    });
}

#[test]
fn calls_that_the_state_does_not_allow_are_refused_and_change_nothing() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let refused = |result: Result<(), model::refusal::Refusals>| assert_eq!(class(result), Class::InvalidState);
        let wait = || rig.system.wait(id, Some(rig.system.now_ns()), std::time::Duration::from_secs(1)).map(|_| ());
        refused(rig.system.suspend(id));
        refused(rig.system.resume(id));
        refused(rig.system.halt(id));
        refused(wait());
        rig.start(id);
        refused(rig.try_start(id, json!({}), Limits::default()));
        refused(rig.system.resume(id));
        refused(rig.system.delete(id));
        rig.system.suspend(id).unwrap();
        assert_eq!(rig.system.state(id), "suspended");
        refused(rig.system.suspend(id));
        refused(rig.try_start(id, json!({}), Limits::default()));
        refused(rig.system.delete(id));
        rig.system.resume(id).unwrap();
        assert_eq!(rig.system.state(id), "running");
        rig.system.halt(id).unwrap();
        rig.wait(id);
        refused(rig.system.halt(id));
        refused(rig.system.suspend(id));
        rig.wait(id);
        rig.system.delete(id).unwrap();
        assert_eq!(rig.system.state(id), "deleted");
        refused(rig.system.delete(id));
        refused(rig.try_start(id, json!({}), Limits::default()));
    });
}

#[test]
fn running_time_stands_still_while_suspended() {
    on_both(|rig| {
        rig.define(verb(
            "v",
            &[("watch", "t.watch")],
            json!({"cells": {"y": ["watch.y"]}, "input_parameters": {"trace": {"targets": ["watch.trace"], "default": 300}},
                   "command_lists": lists(&[("start", &["+watch 1ms", "?10ms", "-watch"])])}),
        ));
        let id = rig.instance("v", &["*@rtp0.fast"]);
        let start = rig.system.now_ns();
        rig.try_start(id, json!({}), Limits { time_limit_ns: Some(12 * MS), overruns: None, ..Limits::default() }).unwrap();
        rig.advance(3);
        rig.system.suspend(id).unwrap();
        rig.advance(50);
        assert_eq!(seen(300).iter().map(|r| r.time_ns / MS).collect::<Vec<_>>(), [1, 2, 3]);
        rig.system.resume(id).unwrap();
        rig.advance(2);
        assert_eq!(seen(300).iter().map(|r| (r.time_ns / MS, (r.now_ns - start) / MS)).collect::<Vec<_>>(), [(4, 54), (5, 55)]);
        let report = rig.wait(id);
        assert_eq!(report.condition, "completed", "the limit counts running time");
        assert_eq!(rig.system.now_ns() - start, 60 * MS);
        assert_eq!(seen(300).last().unwrap().time_ns, 10 * MS);
    });
}

#[test]
fn a_time_limit_ends_it_or_leads_on() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v"));
        let mut of = counter("w");
        of["command_lists"]["late"] = list(&["?2ms"]);
        of["initial"] = json!("start");
        of["transitions"] = tau(&["start, time_limit -> late"]);
        of["conditions"]["completed"] = json!({"returns": ["y"]});
        rig.define(of);
        for (verb, condition, list) in [("v", "time_limit", "start"), ("w", "completed", "late")] {
            let id = rig.instance(verb, &["a=a", "*@rtp0.fast"]);
            rig.try_start(id, json!({}), Limits { time_limit_ns: Some(5 * MS), overruns: None, ..Limits::default() }).unwrap();
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), report.command_list.as_str()), (condition, list));
            assert_eq!(rig.read("a"), 5.0);
        }
    });
}

#[test]
fn a_halt_with_a_transition_is_orderly_and_a_second_one_immediate() {
    on_both(|rig| {
        rig.svv("a");
        let mut of = counter("v");
        of["command_lists"]["brake"] = list(&["+count 1ms", "?3ms"]);
        of["initial"] = json!("start");
        of["transitions"] = tau(&["start, halted -> brake"]);
        of["command_lists"]["brake"] = list(&["+count 1ms", "?3ms", "-count"]);
        rig.define(of);
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        rig.start(id);
        rig.advance(2);
        rig.system.halt(id).unwrap();
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.command_list.as_str(), report.normal), ("halted", "brake", true));
        assert_eq!(rig.read("a"), 5.0);
        rig.start(id);
        rig.advance(2);
        rig.system.halt(id).unwrap();
        rig.advance(1);
        rig.system.halt(id).unwrap();
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.command_list.as_str(), output(&report, "y")), ("halted", "brake", 3.0));
    });
}

#[test]
fn a_suspended_instance_remembers_and_what_others_drive_skips() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v"));
        rig.define(verb(
            "reads",
            &[("probe", "t.probe")],
            json!({"instantiation_parameters": {"a": ["probe.u"]}, "cells": {"p": ["probe.y"]},
                   "input_parameters": {"trace": {"targets": ["probe.trace"], "default": 301}},
                   "command_lists": lists(&[("start", &["+probe"])])}),
        ));
        let writes = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let near = rig.instance("reads", &["a=a", "*@rtp0.fast"]);
        let far = rig.instance("reads", &["a=a", "*@rtp1.soft"]);
        rig.start(writes);
        rig.start(near);
        rig.start_with(far, json!({"trace": 302}));
        rig.advance(3);
        rig.system.suspend(near).unwrap();
        rig.system.suspend(far).unwrap();
        rig.advance(5);
        rig.system.resume(near).unwrap();
        rig.system.resume(far).unwrap();
        rig.advance(2);
        for trace in [301, 302] {
            assert_eq!(seen(trace).iter().map(|r| r.u).collect::<Vec<_>>(), [1.0, 2.0, 3.0, 9.0, 10.0], "{trace}");
        }
    });
}

#[test]
fn suspension_works_at_every_ms_of_a_list_over_several_sources() {
    on_both(|rig| {
        rig.define(verb(
            "v",
            &[("a", "t.count"), ("b", "t.count")],
            json!({"cells": {"ay": ["a.y"], "at": ["a.total"], "by": ["b.y"], "bt": ["b.total"]},
                   "input_parameters": {"a_limit": {"targets": ["a.limit"], "default": 3.0}, "b_limit": {"targets": ["b.limit"], "default": 2.0}},
                   "output_values": {"a": "a.y", "b": "b.y"}, "conditions": {"completed": {"returns": ["a", "b"]}},
                   "command_lists": lists(&[("start", &["!b", "+a 1ms", "?a.reached", "-a", "*b", "+b 1ms", "?2ms", "?b.reached", "-b", "!a"])])}),
        ));
        let id = rig.instance("v", &["a@rtp0.fast", "b@rtp1.other"]);
        for ms in 0..6 {
            let before = rig.system.now_ns();
            rig.start(id);
            rig.advance(ms);
            if rig.system.state(id) == "running" {
                rig.system.suspend(id).unwrap();
                rig.advance(10);
                assert_eq!(rig.system.state(id), "suspended");
                rig.system.resume(id).unwrap();
            }
            let report = rig.wait_for(id, 100).unwrap_or_else(|| panic!("suspended after {ms} ms it never ends"));
            assert_eq!(report.condition, "completed");
            assert_eq!(output(&report, "a"), 4.0);
            assert!(rig.system.now_ns() - before < 20 * MS);
        }
    });
}

#[test]
fn two_instances_of_a_verb_run_side_by_side() {
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(counter("v"));
        let (first, second) = (rig.instance("v", &["a=a", "*@rtp0.fast"]), rig.instance("v", &["a=b", "*@rtp0.fast"]));
        rig.start_with(first, json!({"limit": 5.0}));
        rig.advance(2);
        rig.start_with(second, json!({"limit": 5.0, "start": 1.0}));
        assert_eq!(rig.wait(first).time_s, 0.005);
        assert_eq!(rig.wait(second).time_s, 0.006);
        assert_eq!(rig.read_all(&["a", "b"]), [5.0, 5.0]);
    });
}

#[test]
fn a_verb_is_not_redefined_while_it_is_busy_and_idle_instances_keep_theirs() {
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(counter("v"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let mut other = counter("v");
        other["command_lists"]["start"] = list(&["+count 2ms"]);
        rig.start(id);
        rig.define(counter("v"));
        let refused = rig.try_define(other.clone()).unwrap_err();
        assert!(refused[0].class == Class::InUse && text(&refused).contains("v#"), "{}", text(&refused));
        rig.system.suspend(id).unwrap();
        assert_eq!(class(rig.try_define(other.clone())), Class::InUse);
        rig.system.halt(id).unwrap();
        rig.wait(id);
        rig.define(other);
        let new = rig.instance("v", &["a=b", "*@rtp0.fast"]);
        while rig.system.now_ns() % (2 * MS) != 0 {
            rig.advance(1);
        }
        rig.start(id);
        rig.start(new);
        rig.advance(6);
        assert_eq!(rig.read_all(&["a", "b"]), [6.0, 3.0]);
    });
}

#[test]
fn lists_that_lead_to_each_other_in_no_time_are_ended() {
    let rig = Rig::new(Link::Memory);
    rig.define(verb(
        "v",
        &[("a", "t.count")],
        json!({"cells": {"y": ["a.y"], "t": ["a.total"]}, "command_lists": lists(&[("start", &["!a"])]), "initial": "start", "transitions": tau(&["start, completed -> start"])}),
    ));
    let id = rig.instance("v", &["*@rtp0.fast"]);
    rig.start(id);
    let report = rig.wait(id);
    assert!(report.condition == "fault" && report.message.contains("without time passing"), "{report:?}");
}

#[test]
fn parameters_are_refused_where_another_instance_writes_the_svv() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v"));
        rig.define(verb(
            "reads",
            &[("watch", "t.watch")],
            json!({"instantiation_parameters": {"a": ["watch.u"]}, "cells": {"p": ["watch.y"]}, "input_parameters": {"u": {"targets": ["watch.u"]}},
                   "output_values": {"y": "watch.y"}, "conditions": {"halted": {"returns": ["y"]}},
                   "command_lists": lists(&[("start", &["+watch 1ms"])])}),
        ));
        let (writes, reads) = (rig.instance("v", &["a=a", "*@rtp0.fast"]), rig.instance("reads", &["a=a", "*@rtp1.other"]));
        rig.start_with(reads, json!({"u": 4.0}));
        assert_eq!(rig.read("a"), 4.0);
        rig.advance(2);
        rig.system.halt(reads).unwrap();
        assert_eq!(output(&rig.wait(reads), "y"), 4.0);
        rig.start(writes);
        assert_eq!(class(rig.try_start(reads, json!({"u": 5.0}), Limits::default())), Class::SecondWriter);
        rig.advance(1);
        assert_eq!(rig.read("a"), 1.0);
    });
}
