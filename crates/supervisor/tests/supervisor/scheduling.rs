// SPDX-License-Identifier: Apache-2.0
//! Scenarios: when blocks run and what they see. Intervals and phases, data-driven chains inside a source and across sources,
//! asynchronous and ratio ports, gathers and scatters.
use crate::common::*;
use interconnect::{Faults, Message};
use runtime::ClockKind;
use serde_json::json;

fn values(rows: &[Row]) -> Vec<f64> {
    rows.iter().map(|row| row.u).collect()
}

/// Returns a counter that drives a probe: `count.y` → `probe.u`, with the trace `trace`.
fn chain(name: &str, trace: i64, commands: &[&str]) -> serde_json::Value {
    verb(
        name,
        &[("count", "t.count"), ("probe", "t.probe")],
        json!({"cells": {"c": ["count.y", "probe.u"], "p": ["probe.y"], "t": ["count.total"]},
               "input_parameters": {"trace": {"targets": ["probe.trace"], "default": trace}},
               "command_lists": lists(&[("start", commands)])}),
    )
}

#[test]
fn an_interval_runs_at_its_multiples_and_a_driven_block_in_the_same_firing() {
    on_both(|rig| {
        rig.define(chain("v", 100, &["+count 3ms", "+probe"]));
        let id = rig.instance("v", &["*@rtp0.fast"]);
        rig.advance(4);
        rig.start(id);
        rig.advance(12);
        let rows = seen(100);
        // Started at 4 ms: releases are multiples of 3 ms from the host's epoch.
        assert_eq!(rows.iter().map(|r| (r.now_ns / MS, r.u, r.number)).collect::<Vec<_>>(), [(6, 1.0, 0), (9, 2.0, 1), (12, 3.0, 2), (15, 4.0, 3)]);
        assert_eq!(rows[0].time_ns, 2 * MS, "running time counts from the start");
        rig.system.halt(id).unwrap();
        assert_eq!(rig.wait(id).condition, "halted");
    });
}

#[test]
fn a_synchronous_chain_across_sources_loses_and_doubles_nothing() {
    on_all(|rig| {
        rig.define(chain("v", 101, &["+count 1ms", "+probe"]));
        let id = rig.instance("v", &["count@rtp0.fast", "probe@rtp1.soft"]);
        rig.start(id);
        rig.advance(200);
        let rows = values(&seen(101));
        assert!(rows.len() >= 190, "{}", rows.len());
        assert_eq!(rows, (1..=rows.len()).map(|n| n as f64).collect::<Vec<_>>());
        rig.system.halt(id).unwrap();
        rig.wait(id);
    });
}

#[test]
fn over_memory_a_driven_block_in_another_source_runs_at_the_same_instant() {
    let rig = Rig::new(Link::Memory);
    rig.define(chain("v", 102, &["+count 1ms", "+probe"]));
    let id = rig.instance("v", &["count@rtp0.fast", "probe@rtp1.soft"]);
    rig.start(id);
    rig.advance(3);
    assert_eq!(seen(102).iter().map(|r| (r.now_ns, r.u)).collect::<Vec<_>>(), [(MS, 1.0), (2 * MS, 2.0), (3 * MS, 3.0)]);
}

#[test]
fn a_second_start_takes_nothing_of_the_first() {
    on_all(|rig| {
        rig.define(chain("v", 103, &["+count 1ms", "+probe"]));
        let id = rig.instance("v", &["count@rtp0.fast", "probe@rtp1.soft"]);
        for _ in 0..3 {
            rig.start(id);
            rig.advance(50);
            rig.system.halt(id).unwrap();
            rig.wait(id);
            rig.advance(20);
            let rows = values(&seen(103));
            assert_eq!(rows, (1..=rows.len()).map(|n| n as f64).collect::<Vec<_>>(), "the count begins at 1 again");
            assert!(rows.len() >= 40);
        }
    });
}

#[test]
fn an_asynchronous_input_across_sources_has_the_newest_value() {
    on_both(|rig| {
        rig.define(verb(
            "v",
            &[("count", "t.count"), ("watch", "t.watch")],
            json!({"cells": {"c": ["count.y", "watch.u"], "p": ["watch.y"], "t": ["count.total"]},
                   "input_parameters": {"trace": {"targets": ["watch.trace"], "default": 104}},
                   "command_lists": lists(&[("start", &["+count 1ms", "+watch 4ms"])])}),
        ));
        let id = rig.instance("v", &["count@rtp0.fast", "watch@rtp0.slow"]);
        rig.start(id);
        rig.advance(13);
        // At one instant the source of higher priority fires first.
        assert_eq!(values(&seen(104)), [4.0, 8.0, 12.0]);
    });
}

#[test]
fn an_asynchronous_value_never_goes_back() {
    on_all(|rig| {
        rig.define(verb(
            "v",
            &[("count", "t.count"), ("watch", "t.watch")],
            json!({"cells": {"c": ["count.y", "watch.u"], "p": ["watch.y"], "t": ["count.total"]},
                   "input_parameters": {"trace": {"targets": ["watch.trace"], "default": 105}},
                   "command_lists": lists(&[("start", &["+count 1ms", "+watch 1ms"])])}),
        ));
        let id = rig.instance("v", &["count@rtp0.fast", "watch@rtp1.other"]);
        rig.start(id);
        rig.advance(100);
        let rows = values(&seen(105));
        assert_eq!(rows.len(), 100);
        assert!(rows.is_sorted() && rows[99] > 90.0, "{rows:?}");
    });
}

#[test]
fn a_ratio_input_in_one_source_takes_the_value_before_the_newest() {
    on_both(|rig| {
        rig.define(verb(
            "v",
            &[("count", "t.count"), ("fourth", "t.fourth")],
            json!({"cells": {"c": ["count.y", "fourth.u"], "p": ["fourth.y"], "t": ["count.total"]},
                   "input_parameters": {"trace": {"targets": ["fourth.trace"], "default": 106}},
                   "command_lists": lists(&[("start", &["+count 4ms", "+fourth 1ms"])])}),
        ));
        let id = rig.instance("v", &["*@rtp0.fast"]);
        rig.start(id);
        rig.advance(16);
        let rows = values(&seen(106));
        assert_eq!(rows.len(), 16);
        // Number ⌊j/4⌋ − 1 of the writer; before the first it is the initial value.
        for (j, value) in rows.iter().enumerate().skip(4) {
            assert_eq!(*value, (j / 4) as f64, "invocation {j} of {rows:?}");
        }
        assert_eq!(rows[..4], [0.0; 4]);
    });
}

#[test]
fn a_ratio_input_across_sources_goes_by_number() {
    on_both(|rig| {
        rig.define(verb(
            "v",
            &[("count", "t.count"), ("fourth", "t.fourth")],
            json!({"cells": {"c": ["count.y", "fourth.u"], "p": ["fourth.y"], "t": ["count.total"]},
                   "input_parameters": {"trace": {"targets": ["fourth.trace"], "default": 107}},
                   "command_lists": lists(&[("start", &["+count 4ms", "+fourth 1ms"])])}),
        ));
        let id = rig.instance("v", &["count@rtp0.slow", "fourth@rtp0.fast"]);
        rig.start(id);
        rig.advance(20);
        let rows = values(&seen(107));
        assert_eq!(rows.len(), 20);
        for (j, value) in rows.iter().enumerate().skip(4) {
            assert_eq!(*value, (j / 4) as f64, "invocation {j} of {rows:?}");
        }
    });
}

#[test]
fn a_ratio_output_drives_its_reader_every_nth_time() {
    on_both(|rig| {
        for (trace, placement) in [(108, &["*@rtp0.fast"][..]), (109, &["quarter@rtp0.fast", "probe@rtp1.soft"][..])] {
            rig.define(verb(
                &format!("v{trace}"),
                &[("quarter", "t.quarter"), ("probe", "t.probe")],
                json!({"cells": {"c": ["quarter.y", "probe.u"], "p": ["probe.y"]},
                       "input_parameters": {"trace": {"targets": ["probe.trace"], "default": trace}},
                       "command_lists": lists(&[("start", &["+quarter 1ms", "+probe"])])}),
            ));
            let id = rig.instance(&format!("v{trace}"), placement);
            rig.start(id);
            rig.advance(13);
            assert_eq!(values(&seen(trace)), [4.0, 8.0, 12.0]);
            rig.system.halt(id).unwrap();
            rig.wait(id);
        }
    });
}

#[test]
fn arrays_are_scattered_to_and_gathered_from_svvs() {
    on_both(|rig| {
        rig.svvs(&["a", "b", "c", "x", "sum"]);
        rig.define(verb(
            "v",
            &[("spread", "t.spread"), ("gather", "t.gather")],
            json!({"instantiation_parameters": {"to": ["spread.y"], "from": ["gather.u"], "sum": ["gather.y"]},
                   "input_parameters": {"u": {"targets": ["spread.u"], "default": 1.0}},
                   "command_lists": lists(&[("start", &["+spread 1ms", "+gather 1ms"])])}),
        ));
        // In order, and in a different order with another SVV in between.
        for (to, from, expected) in [("to=a,b,c", "from=a,b,c", 321.0), ("to=a,b,c", "from=c,a,b", 213.0), ("to=c,x,a", "from=x,a,c", 132.0)] {
            let id = rig.instance("v", &[to, from, "sum=sum", "*@rtp0.fast"]);
            rig.start(id);
            rig.advance(2);
            assert_eq!(rig.read("sum"), expected, "{to} {from}");
            rig.system.halt(id).unwrap();
            rig.wait(id);
            rig.system.delete(id).unwrap();
        }
    });
}

#[test]
fn a_trigger_fires_once_a_request() {
    on_both(|rig| {
        rig.define(chain("v", 110, &["+count", "+probe"]));
        let id = rig.instance("v", &["*@rtp0.door"]);
        rig.start(id);
        rig.advance(5);
        assert_eq!(seen(110), []);
        rig.system.request("rtp0.door").unwrap();
        rig.system.request("rtp0.door").unwrap();
        rig.advance(1);
        assert_eq!(values(&seen(110)), [1.0, 2.0]);
    });
}

#[test]
fn an_instance_is_driven_by_the_svv_that_another_writes() {
    on_all(|rig| {
        rig.svv("a");
        rig.define(verb(
            "writes",
            &[("count", "t.count")],
            json!({"instantiation_parameters": {"a": ["count.y"]}, "cells": {"t": ["count.total"]},
                   "command_lists": lists(&[("start", &["+count 1ms"])])}),
        ));
        rig.define(verb(
            "reads",
            &[("probe", "t.probe")],
            json!({"instantiation_parameters": {"a": ["probe.u"]}, "cells": {"p": ["probe.y"]},
                   "input_parameters": {"trace": {"targets": ["probe.trace"]}},
                   "command_lists": lists(&[("start", &["+probe"])])}),
        ));
        let writes = rig.instance("writes", &["a=a", "*@rtp0.fast"]);
        let near = rig.instance("reads", &["a=a", "*@rtp0.fast"]);
        let far = rig.instance("reads", &["a=a", "*@rtp1.soft"]);
        rig.start_with(near, json!({"trace": 111}));
        rig.start_with(far, json!({"trace": 112}));
        rig.start(writes);
        rig.advance(100);
        assert_eq!(values(&seen(111)), (1..=100).map(f64::from).collect::<Vec<_>>());
        let rows = values(&seen(112));
        assert_eq!(rows, (1..=rows.len()).map(|n| n as f64).collect::<Vec<_>>());
        assert!(rows.len() > 90);
        // After a stop and a restart, a reader takes none of the values that arrived in between.
        rig.system.halt(far).unwrap();
        rig.wait(far);
        rig.advance(50);
        seen(111);
        rig.start_with(far, json!({"trace": 112}));
        rig.advance(20);
        let rows = values(&seen(112));
        assert!(rows[0] > 149.0, "{rows:?}");
        assert!(rows.windows(2).all(|w| w[1] == w[0] + 1.0));
        seen(111);
    });
}

#[test]
fn the_halves_of_another_instances_pair_come_together_however_late_they_come() {
    // Half of all messages are lost, so related rows arrive at different times.
    let is_torn = |row: &Row| row.u != 0.0;
    let mut count = 0;
    for seed in 1..40 {
        let link = Message::new(seed, Faults::none());
        link.set_faults(Faults { drop: 0.5, reorder: 0.5, ..Faults::delay(100_000, 100_000) });
        let rig = Rig::over(ClockKind::Virtual { seed: 7 }, Box::new(link));
        rig.svvs(&["a", "b"]);
        let chi = |a: &str, b: &str| json!({"a": [a], "b": [b]});
        rig.define(verb("pair", &[("p", "t.pair")], json!({"instantiation_parameters": chi("p.a", "p.b"), "command_lists": lists(&[("start", &["+p 1ms"])])})));
        rig.define(verb(
            "halves",
            &[("r", "t.halves")],
            json!({"instantiation_parameters": chi("r.u", "r.v"), "cells": {"y": ["r.y"]},
                   "input_parameters": {"trace": {"targets": ["r.trace"], "default": 1960}}, "command_lists": lists(&[("start", &["+r"])])}),
        ));
        let writers = [(); 2].map(|()| rig.instance("pair", &["a=a", "b=b", "p@rtp0.fast"]));
        let reader = rig.instance("halves", &["a=a", "b=b", "r@rtp1.soft"]);
        for writer in [writers[0], writers[1], writers[0]] {
            rig.start(writer);
            rig.advance(3);
            // Started while values are in transit.
            rig.start(reader);
            rig.advance(4);
            for id in [writer, reader] {
                rig.system.halt(id).unwrap();
                rig.wait(id);
            }
        }
        let rows = seen(1960);
        assert!(!rows.iter().any(is_torn), "seed {seed}: {rows:?}");
        count += rows.len();
    }
    assert!(count > 100, "{count} pairs were read");
}
