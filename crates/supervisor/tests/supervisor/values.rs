// SPDX-License-Identifier: Apache-2.0
//! Scenarios: values of SVVs. Hand-over between writers, snapshots, histories; and identical bits in every run.
use crate::common::*;
use model::refusal::Class;
use serde_json::{Value as Json, json};

/// Returns a verb that counts into SVV `a`.
fn counter(name: &str, every: &str) -> Json {
    verb(
        name,
        &[("count", "t.count")],
        json!({"instantiation_parameters": {"a": ["count.y"]}, "cells": {"t": ["count.total"]},
               "input_parameters": {"start": {"targets": ["count.start"], "default": 0.0}},
               "command_lists": lists(&[("start", &[every])])}),
    )
}

/// Returns a verb that follows SVV `a`.
fn follower(name: &str, trace: i64) -> Json {
    verb(
        name,
        &[("watch", "t.watch")],
        json!({"instantiation_parameters": {"a": ["watch.u"]}, "cells": {"p": ["watch.y"]}, "input_parameters": {"trace": {"targets": ["watch.trace"], "default": trace}},
               "command_lists": lists(&[("start", &["+watch 1ms"])])}),
    )
}

#[test]
fn an_svv_keeps_its_value_when_writers_in_different_sources_take_turns() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v", "+count 1ms"));
        rig.define(counter("slow", "+count 4ms"));
        rig.define(follower("f", 400));
        let first = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        let second = rig.instance("slow", &["a=a", "*@rtp0.slow"]);
        let follows = rig.instance("f", &["a=a", "*@rtp1.other"]);
        rig.start(follows);
        rig.start(first);
        rig.advance(10);
        rig.system.halt(first).unwrap();
        rig.wait(first);
        rig.start_with(second, json!({"start": 100.0}));
        assert_eq!(rig.read("a"), 10.0, "nobody has written it since");
        rig.advance(1);
        assert_eq!(rig.read("a"), 10.0);
        rig.advance(3);
        assert_eq!(rig.read("a"), 101.0);
        rig.system.halt(second).unwrap();
        rig.wait(second);
        rig.start(first);
        assert_eq!(rig.read("a"), 101.0);
        rig.advance(2);
        let rows: Vec<f64> = seen(400).iter().map(|r| r.u).collect();
        assert!(rows.windows(2).all(|w| w[1] >= w[0] || w[1] == 1.0), "the follower never sees an older value again: {rows:?}");
        assert!(rows.contains(&101.0) && rows.contains(&10.0), "{rows:?}");
    });
}

#[test]
fn a_value_stored_by_the_programming_system_reaches_every_source() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v", "+count 1ms"));
        rig.define(follower("f", 401));
        let follows = rig.instance("f", &["a=a", "*@rtp1.other"]);
        rig.write("a", 5.0);
        rig.start(follows);
        rig.advance(1);
        rig.write("a", 6.0);
        rig.advance(1);
        let writes = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        rig.start(writes);
        rig.advance(1);
        rig.system.halt(writes).unwrap();
        rig.wait(writes);
        rig.advance(1);
        rig.write("a", 7.0);
        rig.advance(1);
        assert_eq!(seen(401).iter().map(|r| r.u).collect::<Vec<_>>()[..2], [5.0, 6.0]);
        rig.advance(1);
        rig.system.delete(writes).unwrap();
        rig.advance(1);
        assert_eq!(rig.read("a"), 7.0);
        rig.write("a", 8.0);
        rig.advance(1);
        seen(401);
        rig.advance(1);
        assert_eq!(seen(401)[0].u, 8.0);
    });
}

#[test]
fn a_snapshot_is_of_one_boundary() {
    on_both(|rig| {
        rig.svvs(&["a", "b", "c"]);
        rig.define(verb(
            "v",
            &[("count", "t.count"), ("gather", "t.gather"), ("probe", "t.probe")],
            json!({"instantiation_parameters": {"a": ["count.y", "probe.u"], "b": ["probe.y"]}, "cells": {"t": ["count.total"], "u": ["gather.u"], "g": ["gather.y"]},
                   "command_lists": lists(&[("start", &["+count 1ms", "+probe"])])}),
        ));
        let id = rig.instance("v", &["a=a", "b=b", "*@rtp0.fast"]);
        rig.start(id);
        for _ in 0..20 {
            rig.advance(1);
            let values = rig.read_all(&["a", "b", "c"]);
            assert_eq!(values[0], values[1]);
        }
        assert_eq!(class(rig.system.read(&["nothing".to_owned()])), Class::UnknownName);
    });
}

#[test]
fn a_history_is_of_the_svv_and_outlives_its_writers() {
    on_both(|rig| {
        rig.svv_of("a", json!({"type_text": "double", "history": 8}));
        rig.svv("b");
        rig.define(counter("v", "+count 1ms"));
        let values = |count| -> Vec<f64> {
            rig.system.history("a", count).unwrap().iter().map(|(_, _, bytes)| f64::from_le_bytes(bytes.as_slice().try_into().unwrap())).collect()
        };
        assert!(values(8).is_empty());
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        rig.start(id);
        rig.advance(5);
        assert_eq!(values(8), [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(values(2), [4.0, 5.0]);
        rig.system.halt(id).unwrap();
        rig.wait(id);
        rig.system.delete(id).unwrap();
        let again = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        rig.start_with(again, json!({"start": 10.0}));
        rig.advance(2);
        assert_eq!(values(8), [1.0, 2.0, 3.0, 4.0, 5.0, 11.0, 12.0]);
        rig.advance(10);
        assert_eq!(values(100).len(), 8, "as many as were asked for");
        let (_, at_ns, _) = rig.system.history("a", 1).unwrap()[0];
        assert_eq!(at_ns, rig.system.now_ns());
        assert_eq!(class(rig.system.history("b", 1)), Class::ValueRefused);
    });
}

#[test]
fn an_svv_is_deleted_when_nothing_is_bound_to_it() {
    on_both(|rig| {
        rig.svv("a");
        rig.define(counter("v", "+count 1ms"));
        let id = rig.instance("v", &["a=a", "*@rtp0.fast"]);
        assert_eq!(class(rig.system.delete_svv("a")), Class::InvalidState);
        rig.system.delete(id).unwrap();
        rig.system.delete_svv("a").unwrap();
        assert_eq!(class(rig.system.read(&["a".to_owned()])), Class::UnknownName);
        assert_eq!(class(rig.try_create(application("v", &["a=a", "*@rtp0.fast"]))), Class::UnknownName);
    });
}

/// Runs a program over three sources with transitions, halts and suspensions; returns everything observable of its run.
fn run(link: Link) -> String {
    let rig = Rig::new(link);
    rig.svvs(&["a", "b"]);
    rig.define(verb(
        "v",
        &[("count", "t.count"), ("probe", "t.probe"), ("watch", "t.watch")],
        json!({"instantiation_parameters": {"a": ["count.y", "probe.u", "watch.u"], "b": ["watch.y"]}, "cells": {"t": ["count.total"], "p": ["probe.y"]},
               "input_parameters": {"limit": {"targets": ["probe.limit"], "default": 12.0}},
               "output_values": {"y": "probe.y", "w": "watch.y"}, "conditions": {"above": {"on": ["probe.above"]}, "halted": {"returns": ["y", "w"]}},
               "initial": "start", "transitions": tau(&["start, above -> start"]),
               "command_lists": lists(&[("start", &["*count", "+count 1ms", "+probe", "+watch 4ms"])])}),
    ));
    let id = rig.instance("v", &["a=a", "b=b", "count@rtp0.fast", "probe@rtp1.soft", "watch@rtp0.slow"]);
    let mut told = String::new();
    for round in 0..5 {
        rig.start(id);
        rig.advance(17 + round);
        rig.system.suspend(id).unwrap();
        rig.advance(3);
        rig.system.resume(id).unwrap();
        rig.advance(20);
        told += &format!("{:?}", rig.system.read(&["a".to_owned(), "b".to_owned()]).unwrap());
        rig.system.halt(id).unwrap();
        told += &serde_json::to_string(&rig.wait(id)).unwrap();
    }
    told += &serde_json::to_string(&rig.system.log_since(0)).unwrap();
    told
}

#[test]
fn the_same_program_gives_the_same_bits_on_every_run() {
    for link in [Link::Memory, Link::Message, Link::Faulty(1), Link::Faulty(2)] {
        let first = run(link);
        assert!(first.contains("above (reported by 'probe')"));
        assert_eq!(first, run(link), "{link:?}");
    }
}
