// SPDX-License-Identifier: Apache-2.0
//! The supervisor under the monotonic clock, with real threads: bounded by counts, never by time.
mod common;
use common::*;
use runtime::ClockKind;
use serde_json::json;
use std::time::Duration;
use supervisor::WaitResult;

/// Waits for the end, however long it takes.
fn wait(rig: &Rig, id: u64) -> supervisor::Report {
    loop {
        match rig.system.wait(id, None, Duration::from_secs(1)).unwrap_or_else(|r| panic!("{}", text(&r))) {
            WaitResult::Done(report) => return report,
            WaitResult::Slice | WaitResult::TimedOut => {}
        }
    }
}

fn rig() -> Rig {
    let rig = Rig::with(ClockKind::Monotonic, Link::Memory);
    rig.svvs(&["a", "b", "c", "d"]);
    rig.define(verb(
        "v",
        &[("count", "t.count"), ("probe", "t.probe"), ("b", "t.count")],
        json!({"instantiation_parameters": {"a": ["count.y", "probe.u"]}, "cells": {"t": ["count.total"], "p": ["probe.y"], "by": ["b.y"], "bt": ["b.total"]},
               "input_parameters": {"limit": {"targets": ["probe.limit"], "default": 1e9}, "b_limit": {"targets": ["b.limit"], "default": 3.0}},
               "output_values": {"y": "probe.y"}, "initial": "one",
               "conditions": {"above": {"on": ["probe.above"], "returns": ["y"]}, "halted": {"returns": ["y"]}},
               "transitions": tau(&["one, completed -> two", "two, completed -> one"]),
               "command_lists": lists(&[("one", &["!b", "+count 1ms", "+probe", "+b 1ms", "?b.reached", "-b", "-count", "-probe"]), ("two", &["*b", "+count 1ms", "+probe", "?1ms", "-count", "-probe"])])}),
    ));
    rig
}

#[test]
fn a_verb_over_three_sources_counts_to_its_end() {
    let rig = rig();
    let id = rig.instance("v", &["a=a", "count@rtp0.fast", "probe@rtp1.soft", "b@rtp1.other"]);
    for _ in 0..3 {
        rig.start_with(id, json!({"limit": 30.0}));
        let report = wait(&rig, id);
        // Values in flight when the condition occurred finish as part of the verb.
        assert!(report.condition == "above" && output(&report, "y") >= 31.0, "{report:?}");
    }
    rig.system.delete(id).unwrap();
}

#[test]
fn several_threads_call_at_once_and_every_start_has_one_end() {
    let rig = rig();
    let places: [&[&str]; 2] = [&["count@rtp0.fast", "probe@rtp1.soft", "b@rtp1.other"], &["*@rtp0.fast"]];
    std::thread::scope(|scope| {
        for (n, svv) in ["a=a", "a=b", "a=c", "a=d"].into_iter().enumerate() {
            let rig = &rig;
            scope.spawn(move || {
                for round in 0..25 {
                    let given: Vec<&str> = places[(n + round) % 2].iter().copied().chain([svv]).collect();
                    let id = rig.instance("v", &given);
                    for start in 1..=3 {
                        rig.start(id);
                        if round % 3 == 1 && rig.system.suspend(id).is_ok() && rig.system.state(id) == "suspended" {
                            rig.system.resume(id).unwrap();
                        }
                        if round % 2 == 1 {
                            rig.read("a");
                        }
                        rig.system.halt(id).unwrap();
                        let report = wait(rig, id);
                        assert_eq!((report.condition.as_str(), report.start), ("halted", start));
                    }
                    rig.system.delete(id).unwrap();
                }
            });
        }
    });
    let (starts, ends) = (rig.logged("start").len(), rig.logged("end").len());
    assert_eq!((starts, ends), (300, 300));
    let statistics = rig.system.statistics();
    assert!(statistics.sources.values().all(|source| source.steps == 0), "{statistics:?}");
}
