// SPDX-License-Identifier: Apache-2.0
//! Taps: every value exactly once, wherever it is written, regardless of other observers; lost values are counted; computed values never
//! change.
use crate::common::*;
use model::refusal::Class;
use runtime::ClockKind;
use serde_json::{Value as Json, json};
use std::time::Duration;
use supervisor::{Samples, Tap};

/// Returns a verb that counts into SVV `a`, and its invocations into the private cell `t`.
fn counter(name: &str, every: &str) -> Json {
    verb(
        name,
        &[("count", "t.count")],
        json!({"instantiation_parameters": {"a": ["count.y"]}, "cells": {"t": ["count.total"]},
               "input_parameters": {"start": {"targets": ["count.start"], "default": 0.0}},
               "command_lists": lists(&[("start", &[every])])}),
    )
}

fn tap(rig: &Rig, names: &[&str]) -> Tap {
    let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    rig.system.tap(&names).unwrap_or_else(|r| panic!("{}", text(&r)))
}

/// Returns all values so far, by channel as (number, ms, value), and checks that none was lost.
fn taken(tap: &mut Tap) -> Vec<Vec<(u64, i64, f64)>> {
    let mut samples = Samples::default();
    tap.take(&mut samples);
    assert!(samples.runs.iter().all(|run| run.lost == 0), "{samples:?}");
    let values = |run: &supervisor::Run| -> Vec<f64> { run.bytes.chunks(8).map(|value| f64::from_le_bytes(value.try_into().unwrap())).collect() };
    let numbered = |run: &supervisor::Run| run.numbers.iter().zip(&run.times_ns).map(|(number, time)| (*number, time / MS)).collect::<Vec<_>>();
    samples.runs.iter().map(|run| numbered(run).into_iter().zip(values(run)).map(|((number, ms), value)| (number, ms, value)).collect()).collect()
}

fn values(run: &[(u64, i64, f64)]) -> Vec<f64> {
    run.iter().map(|(_, _, value)| *value).collect()
}

fn end(rig: &Rig, id: u64) {
    rig.system.halt(id).unwrap();
    rig.wait(id);
}

#[test]
fn every_value_of_an_svv_and_of_a_private_cell_comes_once_with_number_and_time() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v", "+count 1ms"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let mut tap = tap(rig, &["a", "v#1:t"]);
        assert_eq!(tap.channels()[1].name, "v#1:t");
        assert_eq!((tap.channels()[0].type_text.as_str(), tap.channels()[0].size), ("double", 8));
        rig.start(id);
        rig.advance(5);
        let first = taken(&mut tap);
        assert_eq!(first[0], [(0, 1, 1.0), (1, 2, 2.0), (2, 3, 3.0), (3, 4, 4.0), (4, 5, 5.0)]);
        assert_eq!(first[1], first[0]);
        assert!(taken(&mut tap).iter().all(Vec::is_empty));
        rig.advance(1);
        assert_eq!(values(&taken(&mut tap)[0]), [6.0]);
    });
}

#[test]
fn it_goes_along_from_home_to_home_and_from_start_to_start() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v", "+count 1ms"));
        rig.define(counter("slow", "+count 4ms"));
        let mut tap = tap(rig, &["a"]);
        let first = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let second = rig.instance("slow", &["a=a", "*@rtp0.slow"]);
        let third = rig.instance("v", &["a=a", "*@rtp1.other"]);
        let mut expected = Vec::new();
        for round in 0..3 {
            let base = 1000.0 * f64::from(round);
            for (id, offset, ms, count) in [(first, 0.0, 3, 3), (second, 100.0, 8, 2), (third, 200.0, 2, 2)] {
                rig.start_with(id, json!({"start": base + offset}));
                rig.advance(ms);
                rig.align();
                end(rig, id);
                let written: Vec<f64> = (1..=count).map(|n| base + offset + f64::from(n)).collect();
                expected.extend(written);
            }
        }
        let mut got = values(&taken(&mut tap)[0]);
        // Values in flight at a halt may add one to those of the whole milliseconds.
        got.retain(|value| expected.contains(value));
        assert_eq!(got, expected);
    });
}

#[test]
fn it_goes_along_from_block_to_block_wherever_they_are() {
    on_both(|rig| {
        for (a, b) in [("rtp0.fast", "rtp0.slow"), ("rtp0.slow", "rtp0.fast"), ("rtp0.fast", "rtp0.fast")] {
            let name = format!("{}{}", &a[5..], &b[5..]);
            rig.svv(&name);
            rig.define(verb(
                &name,
                &[("a", "t.count"), ("b", "t.count")],
                json!({"instantiation_parameters": {"a": ["a.y", "b.y"]}, "cells": {"t": ["a.total"], "u": ["b.total"]},
                       "input_parameters": {"limit": {"targets": ["a.limit"], "default": 3.0}, "begin": {"targets": ["b.start"], "default": 100.0}},
                       "conditions": {"reached": {"on": ["a.reached"]}}, "initial": "one", "transitions": tau(&["one, reached -> two"]),
                       "command_lists": lists(&[("one", &["+a 4ms"]), ("two", &["+b 4ms"])])}),
            ));
            let mut tap = tap(rig, &[&name]);
            let id = rig.instance(&name, &[&format!("a={name}"), &format!("a@{a}"), &format!("b@{b}")]);
            rig.start(id);
            rig.advance(40);
            rig.align();
            let told: Vec<(u64, f64)> = taken(&mut tap)[0].iter().map(|(number, _, value)| (*number, *value)).collect();
            let second = told.iter().position(|(_, value)| *value > 100.0).expect("the second has written");
            assert!(second >= 3 && told.len() >= second + 4, "{told:?}");
            let numbered = |from: f64, of: &[(u64, f64)]| (0..).zip(of).all(|(at, value)| *value == (at, from + 1.0 + at as f64));
            assert!(numbered(0.0, &told[..second]) && numbered(100.0, &told[second..]), "{told:?}");
            end(rig, id);
        }
    });
}

#[test]
fn a_faulted_invocation_is_no_value_and_those_beside_it_are() {
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(verb(
            "v",
            &[("bad", "t.faulty"), ("count", "t.count")],
            json!({"instantiation_parameters": {"a": ["bad.y"], "b": ["count.y"]}, "cells": {"t": ["count.total"]}, "transitions": tau(&["start, fault -> start"]),
                   "initial": "start", "command_lists": lists(&[("start", &["+bad 1ms", "+count 1ms"])])}),
        ));
        let mut tap = tap(rig, &["a", "b"]);
        let id = rig.instance("v", &["a=a", "b=b", "*@rtp0.fast"]);
        rig.start(id);
        rig.advance(6);
        let told = taken(&mut tap);
        assert_eq!(told[0].iter().map(|(number, ..)| *number).collect::<Vec<_>>(), [0, 1, 2, 4, 5], "invocation 3 is none");
        assert_eq!(told[1].iter().map(|(number, ..)| *number).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
        end(rig, id);
    });
}

#[test]
fn those_who_come_and_go_disturb_nobody() {
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(counter("v", "+count 1ms"));
        let (first, second) = (rig.instance("v", &["a=a", "*@rtp0.fast"]), rig.instance("v", &["a=b", "*@rtp0.fast"]));
        let mut steady = tap(rig, &["a"]);
        rig.start(first);
        rig.start(second);
        let mut got = Vec::new();
        for round in 0..5 {
            let mut other = tap(rig, &["b", "a", "v#2:t"]);
            rig.advance(3);
            let seen = taken(&mut other);
            assert_eq!(seen.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3, 3]);
            if round % 2 == 0 {
                got.extend(values(&taken(&mut steady)[0]));
            }
            drop(other);
            rig.advance(1);
        }
        got.extend(values(&taken(&mut steady)[0]));
        assert_eq!(got, (1..=20).map(f64::from).collect::<Vec<_>>());
    });
}

#[test]
fn who_reads_too_late_is_told_how_many_values_of_each_were_lost() {
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(counter("v", "+count 1ms"));
        rig.define(counter("seldom", "+count 7ms"));
        let (often, seldom) = (rig.instance("v", &["a=a", "*@rtp0.fast"]), rig.instance("seldom", &["a=b", "*@rtp0.fast"]));
        let mut tap = tap(rig, &["a", "b"]);
        rig.start(often);
        rig.start(seldom);
        let mut samples = Samples::default();
        let mut counted = [0, 0];
        for ms in [3, 20_000, 5, 30_011] {
            rig.advance(ms);
            tap.take(&mut samples);
            for (count, run) in counted.iter_mut().zip(&samples.runs) {
                *count += run.lost + run.len() as u64;
                assert_eq!(run.lost > 0, ms > 20, "{ms}: {} lost of {}", run.lost, run.len());
            }
        }
        assert_eq!(rig.read_all(&["a", "b"]), counted.map(|count| count as f64), "each value came or was counted as lost");
    });
}

#[test]
fn a_ratio_output_gives_the_values_that_it_stores() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(verb("v", &[("q", "t.quarter")], json!({"instantiation_parameters": {"a": ["q.y"]}, "command_lists": lists(&[("start", &["+q 1ms"])])})));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let mut tap = tap(rig, &["a"]);
        rig.start(id);
        rig.advance(17);
        assert_eq!(values(&taken(&mut tap)[0]), [4.0, 8.0, 12.0, 16.0]);
        let mut samples = Samples::default();
        rig.advance(40_000);
        tap.take(&mut samples);
        assert_eq!(samples.runs[0].lost + samples.runs[0].len() as u64, 10_000);
    });
}

#[test]
fn stores_of_the_programming_system_are_values_too() {
    on_both(|rig| {
        rig.svvs(&["a", "b"]);
        rig.define(counter("v", "+count 1ms"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        rig.write("a", 5.0);
        let mut tap = tap(rig, &["a", "b"]);
        rig.write("b", 1.0);
        rig.write("b", 1.0);
        rig.write("a", 7.0);
        let stored = taken(&mut tap);
        assert_eq!((values(&stored[0]), values(&stored[1])), (vec![7.0], vec![1.0, 1.0]), "nothing writes them: each store counts");
        rig.start(id);
        rig.advance(2);
        end(rig, id);
        taken(&mut tap);
        rig.write("a", 9.0);
        rig.write("a", 10.0);
        assert_eq!(values(&taken(&mut tap)[0]), [9.0, 10.0], "it has a home now");
    });
}

#[test]
fn an_instance_made_anew_under_its_name_is_followed() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v", "+count 1ms"));
        let named = json!({"verb": "v", "name": "here", "arguments": {"a": {"svv": "a"}}, "placement": {"*": "rtp0.fast"}});
        let id = rig.create(named.clone());
        let mut tap = tap(rig, &["here:t"]);
        rig.start(id);
        rig.advance(2);
        end(rig, id);
        rig.system.delete(id).unwrap();
        rig.advance(2);
        let id = rig.create(named);
        rig.start(id);
        rig.advance(2);
        let got = values(&taken(&mut tap)[0]);
        assert_eq!((got[0], got[got.len() - 2..].to_vec()), (1.0, vec![1.0, 2.0]));
    });
}

#[test]
fn what_is_not_there_is_refused_by_its_name() {
    let rig = Rig::new(Link::Memory);
    rig.svv("a");
    rig.define(counter("v", "+count 1ms"));
    rig.instance("v", &["a=a", "*@rtp0.fast"]);
    for wrong in ["b", "w#1:t", "v#1:u"] {
        assert_eq!(class(rig.system.tap(&[wrong.to_owned()]).map(drop)), Class::UnknownName, "{wrong}");
    }
}

/// Returns the trace of a program over two processors with preemption.
fn trace(observed: bool, number: i64) -> Vec<Row> {
    let rig = Rig::new(Link::Faulty(3));
    rig.svvs(&["a", "b"]);
    rig.define(counter("v", "+count 1ms"));
    rig.define(verb(
        "f",
        &[("watch", "t.watch")],
        json!({"instantiation_parameters": {"a": ["watch.u"]}, "cells": {"p": ["watch.y"]}, "input_parameters": {"trace": {"targets": ["watch.trace"], "default": number}},
               "command_lists": lists(&[("start", &["+watch 1ms"])])}),
    ));
    let (counts, watches) = (rig.instance("v", &["a=a", "*@rtp0.fast"]), rig.instance("f", &["a=a", "*@rtp1.other"]));
    let mut taps = if observed { vec![tap(&rig, &["a", "b", "v#1:t", "f#1:p"])] } else { Vec::new() };
    rig.start(watches);
    rig.start(counts);
    for _ in 0..20 {
        rig.advance(7);
        if observed {
            taps.push(tap(&rig, &["a", "f#1:p"]));
            if taps.len() > 3 {
                taps.remove(1);
            }
        }
    }
    seen(number)
}

#[test]
fn nothing_that_is_computed_changes() {
    let plain = trace(false, 900);
    assert_eq!(plain.len(), 140);
    assert_eq!(plain, trace(true, 901));
}

#[test]
fn time_waits_for_who_holds_it() {
    let rig = Rig::new(Link::Memory);
    rig.svv("a");
    rig.define(counter("v", "+count 1ms"));
    let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
    let mut tap = tap(&rig, &["a"]);
    tap.hold_time();
    rig.start(id);
    let firings: u64 = 50_000;
    let (mut samples, mut count) = (Samples::default(), 0);
    std::thread::scope(|scope| {
        scope.spawn(|| rig.advance(i64::try_from(firings).unwrap()));
        while count < firings {
            tap.wait(Duration::from_millis(20));
            tap.take(&mut samples);
            assert_eq!(samples.runs[0].lost, 0);
            count += samples.runs[0].len() as u64;
        }
    });
    assert_eq!(count, firings);
}

#[test]
fn with_real_threads_every_number_comes_once() {
    let rig = Rig::with(ClockKind::Monotonic, Link::Memory);
    rig.svvs(&["a", "b"]);
    rig.define(counter("v", "+count 1ms"));
    let ids = [rig.instance("v", &["a=a", "*@rtp0.fast"]), rig.instance("v", &["a=b", "*@rtp1.other"])];
    let mut steady = tap(&rig, &["a", "b"]);
    ids.iter().for_each(|id| rig.start(*id));
    let (mut samples, mut last, mut lost) = (Samples::default(), [None, None], 0);
    while last.iter().any(|number: &Option<f64>| number.is_none_or(|number| number < 200.0)) {
        let other = tap(&rig, &["b", "v#1:t"]);
        steady.take(&mut samples);
        for (last, run) in last.iter_mut().zip(&samples.runs) {
            lost += run.lost;
            for value in run.bytes.chunks(8).map(|value| f64::from_le_bytes(value.try_into().unwrap())) {
                assert!(run.lost > 0 || last.is_none_or(|before| value == before + 1.0), "{value} after {last:?}");
                *last = Some(value);
            }
        }
        drop(other);
    }
    assert!(lost == 0 || last.iter().all(Option::is_some));
}
