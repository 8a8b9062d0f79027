// SPDX-License-Identifier: Apache-2.0
//! Scenarios: command lists, waits, transitions, and the choice of the condition that acts.
use crate::common::*;
use serde_json::json;

/// Returns a verb with a fast and a slow counter with probes behind asynchronous inputs, in these lists.
fn two(name: &str, command_lists: serde_json::Value, rest: serde_json::Value) -> serde_json::Value {
    let mut of = verb(
        name,
        &[("a", "t.count"), ("b", "t.count"), ("w", "t.watch")],
        json!({"cells": {"ay": ["a.y", "w.u"], "at": ["a.total"], "by": ["b.y"], "bt": ["b.total"], "wy": ["w.y"]},
               "input_parameters": {"trace": {"targets": ["w.trace"], "default": 0}, "a_limit": {"targets": ["a.limit"], "default": 0.0}, "b_limit": {"targets": ["b.limit"], "default": 0.0},
                                    "a_each": {"targets": ["a.each"], "default": 0.0}},
               "output_values": {"a": "a.y", "b": "b.y", "each": "a.each"},
               "command_lists": command_lists}),
    );
    for (key, value) in rest.as_object().unwrap() {
        of[key] = value.clone();
    }
    of
}

/// One source, where the answers are reactions, and two, where they are the supervisor's.
const PLACES: [&[&str]; 2] = [&["*@rtp0.fast"], &["a@rtp0.fast", "b@rtp1.other", "w@rtp0.fast"]];

#[test]
fn executes_run_in_order_before_what_is_activated() {
    on_both(|rig| {
        rig.define(two("v", lists(&[("start", &["!a", "!a", "!w", "+w 1ms"])]), json!({})));
        let id = rig.instance("v", &["*@rtp0.fast"]);
        rig.start_with(id, json!({"trace": 200}));
        assert_eq!(seen(200).iter().map(|r| (r.now_ns, r.u)).collect::<Vec<_>>(), [(0, 2.0)], "at once, between two firings");
        rig.advance(2);
        assert_eq!(seen(200).iter().map(|r| (r.now_ns, r.u, r.number)).collect::<Vec<_>>(), [(MS, 2.0, 1), (2 * MS, 2.0, 2)]);
    });
}

#[test]
fn executes_across_sources_run_in_order() {
    on_both(|rig| {
        rig.define(two("v", lists(&[("start", &["!a", "!b", "!a", "!w"])]), json!({"conditions": {"completed": {"returns": ["a", "b"]}}})));
        let id = rig.instance("v", &["a@rtp0.fast", "b@rtp1.other", "w@rtp0.fast"]);
        rig.start_with(id, json!({"trace": 201}));
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.normal, report.time_s), ("completed", true, 0.0));
        assert_eq!((output(&report, "a"), output(&report, "b")), (2.0, 1.0));
        assert_eq!(seen(201).iter().map(|r| r.u).collect::<Vec<_>>(), [2.0]);
    });
}

#[test]
fn a_wait_for_a_condition_goes_on_in_the_firing_that_reports_it() {
    on_both(|rig| {
        for (placement, trace) in PLACES.iter().zip([202, 203]) {
            let name = format!("v{trace}");
            rig.define(two(
                &name,
                lists(&[("start", &["+a 1ms", "?a.reached", "-a", "+b 1ms", "+w 1ms", "?b.reached", "-b", "-w"])]),
                json!({"conditions": {"completed": {"returns": ["a", "b"]}}}),
            ));
            let id = rig.instance(&name, placement);
            let start_ms = rig.system.now_ns() / MS;
            rig.start_with(id, json!({"trace": trace, "a_limit": 3.0, "b_limit": 4.0}));
            let report = rig.wait(id);
            assert_eq!(report.condition, "completed");
            assert_eq!((output(&report, "a"), output(&report, "b")), (3.0, 4.0), "{placement:?}");
            let rows: Vec<i64> = seen(trace).iter().map(|r| r.now_ns / MS - start_ms).collect();
            assert!(rows == [4, 5, 6, 7] || (placement.len() > 1 && rows == [4, 5, 6]), "{rows:?}");
        }
    });
}

#[test]
fn a_wait_for_a_time_lasts_its_time() {
    on_both(|rig| {
        for (placement, trace) in PLACES.iter().zip([204, 205]) {
            let name = format!("v{trace}");
            rig.define(two(&name, lists(&[("start", &["+a 1ms", "?5ms", "-a", "?3ms"])]), json!({"conditions": {"completed": {"returns": ["a"]}}})));
            let id = rig.instance(&name, placement);
            let before = rig.system.now_ns();
            rig.start(id);
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), output(&report, "a")), ("completed", 5.0));
            assert_eq!(rig.system.now_ns() - before, 8 * MS);
        }
    });
}

#[test]
fn a_bare_wait_ends_when_nothing_is_active() {
    on_both(|rig| {
        rig.define(two(
            "v",
            lists(&[("start", &["!a", "?", "!a", "+b 1ms", "?"])]),
            json!({"conditions": {"done": {"on": ["b.reached"], "returns": ["a", "b"]}}}),
        ));
        let id = rig.instance("v", &["*@rtp0.fast"]);
        rig.start_with(id, json!({"b_limit": 3.0}));
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), output(&report, "a"), output(&report, "b")), ("done", 2.0, 3.0));
    });
}

#[test]
fn a_wait_takes_a_condition_that_came_before_it() {
    on_both(|rig| {
        for (placement, n) in PLACES.iter().zip([0, 1]) {
            let name = format!("v{n}");
            // `a` reports while the list waits for a duration.
            rig.define(two(
                &name,
                lists(&[("start", &["+a 1ms", "+b 1ms", "?2ms", "-a", "?3ms", "?a.reached", "-b"])]),
                json!({"conditions": {"completed": {"returns": ["a", "b"]}}}),
            ));
            let id = rig.instance(&name, placement);
            let before = rig.system.now_ns();
            rig.start_with(id, json!({"a_limit": 2.0}));
            let report = rig.wait_for(id, 100).unwrap_or_else(|| panic!("the wait missed the condition: {placement:?}"));
            assert_eq!(report.condition, "completed");
            assert_eq!(rig.system.now_ns() - before, 5 * MS);
        }
    });
}

#[test]
fn a_wait_takes_the_condition_of_an_execute_before_it() {
    on_both(|rig| {
        for (placement, n) in PLACES.iter().zip([0, 1]) {
            let name = format!("v{n}");
            rig.define(two(
                &name,
                lists(&[("start", &["!a", "+b 1ms", "?a.reached", "!a", "+w 1ms", "?b.reached", "-b", "-w"])]),
                json!({"conditions": {"completed": {"returns": ["a", "b"]}}}),
            ));
            let id = rig.instance(&name, placement);
            rig.start_with(id, json!({"a_limit": 1.0, "b_limit": 3.0}));
            let report = rig.wait_for(id, 100).unwrap_or_else(|| panic!("b was never activated, or the wait missed: {placement:?}"));
            assert_eq!((report.condition.as_str(), output(&report, "a"), output(&report, "b")), ("completed", 2.0, 3.0));
        }
    });
}

#[test]
fn transitions_cycle_without_the_programming_system() {
    on_both(|rig| {
        for (placement, n) in PLACES.iter().zip([0, 1]) {
            let name = format!("v{n}");
            let of = lists(&[("one", &["*a", "+a 1ms"]), ("two", &["*b", "+b 1ms"])]);
            let rest = json!({"initial": "one", "conditions": {"a_done": {"on": ["a.reached"]}, "b_done": {"on": ["b.reached"]}},
                              "transitions": tau(&["one, a_done -> two", "two, b_done -> one"])});
            rig.define(two(&name, of, rest));
            let id = rig.instance(&name, placement);
            let before = rig.logged("transition").len();
            rig.start_with(id, json!({"a_limit": 2.0, "b_limit": 3.0}));
            rig.advance(52);
            let transitions = rig.logged("transition").len() - before;
            // If the cycle continues in a source that fires later in the instant, it is a ms shorter.
            assert!((20..=26).contains(&transitions), "{transitions} in 52 ms: {placement:?}");
            rig.system.halt(id).unwrap();
            assert_eq!(rig.wait(id).condition, "halted");
            rig.system.delete(id).unwrap();
        }
    });
}

#[test]
fn a_transition_to_the_same_list_runs_it_again() {
    on_both(|rig| {
        let rest = json!({"conditions": {"again": {"on": ["a.reached"]}, "halted": {"returns": ["a", "b"]}}, "transitions": tau(&["start, again -> start"])});
        rig.define(two("v", lists(&[("start", &["!b", "*a", "+a 1ms"])]), rest));
        let id = rig.instance("v", &["*@rtp0.fast"]);
        rig.start_with(id, json!({"a_limit": 4.0}));
        rig.advance(10);
        rig.system.halt(id).unwrap();
        let report = rig.wait(id);
        assert_eq!((output(&report, "a"), output(&report, "b")), (2.0, 3.0));
    });
}

#[test]
fn a_block_that_is_active_in_both_lists_keeps_state_and_phase() {
    on_both(|rig| {
        for (placement, trace) in PLACES.iter().zip([206, 207]) {
            let name = format!("v{trace}");
            let of = lists(&[("one", &["+a 3ms", "+w 3ms", "+b 1ms"]), ("two", &["+a 3ms", "+w 3ms"])]);
            let rest = json!({"initial": "one", "conditions": {"b_done": {"on": ["b.reached"]}}, "transitions": tau(&["one, b_done -> two"])});
            rig.define(two(&name, of, rest));
            let id = rig.instance(&name, placement);
            while rig.system.now_ns() % (3 * MS) != 0 {
                rig.advance(1);
            }
            let start = rig.system.now_ns();
            rig.start_with(id, json!({"trace": trace, "b_limit": 4.0}));
            rig.advance(12);
            let rows: Vec<(i64, f64, u64)> = seen(trace).iter().map(|r| ((r.now_ns - start) / MS, r.u, r.number)).collect();
            assert_eq!(rows, [(3, 1.0, 0), (6, 2.0, 1), (9, 3.0, 2), (12, 4.0, 3)], "{placement:?}");
            rig.system.halt(id).unwrap();
            rig.wait(id);
        }
    });
}

#[test]
fn install_gives_fresh_state_and_keep_is_kept() {
    on_both(|rig| {
        let rest = json!({"output_values": {"a": "a.y", "total": "a.total"}, "conditions": {"completed": {"returns": ["a", "total"]}}});
        rig.define(two("v", lists(&[("start", &["!a", "!a", "!a", "*a", "!a"])]), rest));
        let id = rig.instance("v", &["*@rtp0.fast"]);
        for start in 1..4 {
            rig.start(id);
            let report = rig.wait(id);
            assert_eq!((output(&report, "a"), output(&report, "total")), (1.0, f64::from(4 * start)));
        }
    });
}

#[test]
fn only_what_nu_names_is_returned_and_values_are_those_of_the_boundary() {
    on_both(|rig| {
        for (placement, n) in PLACES.iter().zip([0, 1]) {
            let name = format!("v{n}");
            let rest = json!({"conditions": {"a_done": {"on": ["a.reached"], "returns": ["a"]}, "b_done": {"on": ["b.reached"], "raises": true}, "each": {"on": ["a.each"], "returns": ["each", "a"]}}});
            rig.define(two(&name, lists(&[("start", &["+a 1ms", "+b 1ms"])]), rest));
            let id = rig.instance(&name, placement);
            rig.start_with(id, json!({"a_limit": 7.0}));
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), report.normal, report.block.as_deref()), ("a_done", true, Some("a")));
            assert_eq!((report.outputs.len(), output(&report, "a")), (1, 7.0));

            rig.start_with(id, json!({"b_limit": 2.0}));
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), report.normal, report.outputs.len()), ("b_done", false, 0));

            rig.start_with(id, json!({"a_each": 3.0}));
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), output(&report, "each"), output(&report, "a")), ("each", 3.0, 3.0));
            assert_eq!(report.value, Some(model::value::Value::Number(3.0)));
            assert_eq!(report.start, 3);
        }
    });
}

#[test]
fn of_simultaneous_conditions_the_first_by_priority_acts_and_the_others_are_reported() {
    on_both(|rig| {
        let conditions = |p: i32, q: i32| json!({"conditions": {"a_done": {"on": ["a.reached"], "returns": [], "priority": p}, "b_done": {"on": ["b.reached"], "returns": [], "priority": q}}});
        for (name, p, q, first, other) in [("v1", 0, 0, "a_done", "b_done"), ("v2", 0, 5, "b_done", "a_done"), ("v3", 1, 0, "a_done", "b_done")] {
            rig.define(two(name, lists(&[("start", &["+a 1ms", "+b 1ms"])]), conditions(p, q)));
            let id = rig.instance(name, &["*@rtp0.fast"]);
            rig.start_with(id, json!({"a_limit": 2.0, "b_limit": 2.0}));
            let report = rig.wait(id);
            assert_eq!(report.condition, first);
            assert_eq!(report.others.iter().map(|o| o.condition.as_str()).collect::<Vec<_>>(), [other]);
        }
    });
}

#[test]
fn a_condition_during_one_list_means_nothing_in_another() {
    on_both(|rig| {
        for (placement, n) in PLACES.iter().zip([0, 1]) {
            let name = format!("v{n}");
            let of = lists(&[("one", &["+a 1ms", "+b 1ms"]), ("two", &["+a 1ms"])]);
            let rest = json!({"initial": "one", "conditions": {"a_done": {"on": ["a.reached"], "during": "two", "returns": ["a"]}, "b_done": {"on": ["b.reached"]}},
                              "transitions": tau(&["one, b_done -> two"])});
            rig.define(two(&name, of, rest));
            let id = rig.instance(&name, placement);
            rig.start_with(id, json!({"a_limit": 1.0, "b_limit": 5.0}));
            let report = rig.wait(id);
            assert_eq!((report.condition.as_str(), report.command_list.as_str()), ("a_done", "two"));
            assert!((5.0..=6.0).contains(&output(&report, "a")), "{report:?}");
        }
    });
}

#[test]
fn a_second_start_executes_what_another_source_takes_one_by_one() {
    on_both(|rig| {
        rig.define(verb(
            "v",
            &[("count", "t.count"), ("probe", "t.probe")],
            json!({"cells": {"y": ["count.y", "probe.u"], "t": ["count.total"], "p": ["probe.y"]},
                   "input_parameters": {"trace": {"targets": ["probe.trace"], "default": 1951}},
                   "command_lists": lists(&[("start", &["!count", "+count 1ms", "+probe"])])}),
        ));
        let id = rig.instance("v", &["count@rtp0.fast", "probe@rtp1.soft"]);
        let mut lives = Vec::new();
        for _ in 0..3 {
            rig.align();
            rig.start(id);
            rig.advance(20);
            rig.system.halt(id).unwrap();
            rig.wait(id);
            lives.push(seen(1951).iter().map(|row| row.u).collect::<Vec<_>>());
        }
        // Values left by the previous life do not affect this one.
        assert!(lives[0].len() >= 15 && lives.iter().all(|life| *life == lives[0]), "{lives:?}");
    });
}

#[test]
fn lists_that_lead_to_each_other_by_what_they_execute_end_in_their_instant() {
    on_both(|rig| {
        // The supervisor answers: no kernel has both sources of a list.
        rig.define(two(
            "v",
            lists(&[("one", &["!a", "+b 1ms"]), ("two", &["!a", "+b 1ms"]), ("three", &["+b 1ms"])]),
            json!({"initial": "one", "conditions": {"enough": {"on": ["a.reached"]}},
                   "transitions": tau(&["one, enough -> two", "two, enough -> one", "one, halted -> three"])}),
        ));
        let id = rig.instance("v", PLACES[1]);
        rig.start_with(id, json!({"a_limit": 1.0}));
        let report = rig.wait(id);
        assert_eq!((report.condition.as_str(), report.normal, report.time_s), ("fault", false, 0.0));
        let named = "command lists of verb 'v' lead to each other without time passing ('one', 'two')";
        assert!(report.message.contains(named), "{}", report.message);
        // No state remains: it starts again without a loop.
        rig.start(id);
        rig.advance(3);
        assert_eq!(rig.system.state(id).to_string(), "running");
    });
}
