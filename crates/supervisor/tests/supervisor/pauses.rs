// SPDX-License-Identifier: Apache-2.0
//! Pause and resume of a program, in any order with starts, halts, suspensions and emergency stops: paused verbs do not move, every start
//! has exactly one end, and individually suspended instances stay suspended.
use crate::common::*;
use model::refusal::Class;
use proptest::prelude::*;
use serde_json::json;
use std::collections::{BTreeSet, HashMap};
use std::time::Duration;
use supervisor::{DeviceRequest, Limits, WaitResult};

const LONG: Duration = Duration::from_secs(300);
const JOINTS: [&str; 2] = ["j1", "j2"];

#[derive(Clone, Copy, Debug)]
enum Call {
    Start {
        which: usize,
        time_limit_ms: Option<u8>,
    },
    Halt(usize),
    Suspend(usize),
    Resume(usize),
    /// Pauses one joint, or all.
    Pause(Option<usize>),
    Unpause(Option<usize>),
    Disable(usize),
    EmergencyStop,
    Advance(u8),
}

fn call() -> impl Strategy<Value = Call> {
    let scope = || prop::option::weighted(0.6, 0..2usize);
    prop_oneof![
        6 => (0..3usize, prop::option::weighted(0.2, 1..20u8)).prop_map(|(which, time_limit_ms)| Call::Start { which, time_limit_ms }),
        2 => (0..3usize).prop_map(Call::Halt),
        1 => (0..3usize).prop_map(Call::Suspend),
        2 => (0..3usize).prop_map(Call::Resume),
        4 => scope().prop_map(Call::Pause),
        5 => scope().prop_map(Call::Unpause),
        1 => (0..2usize).prop_map(Call::Disable),
        1 => Just(Call::EmergencyStop),
        6 => (0..12u8).prop_map(Call::Advance),
    ]
}

/// Creates two joints, and three verbs that count into the commanded values of one, of the other, and of both; a halt has its own list.
fn rig(link: Link) -> Rig {
    let rig = Rig::new(link);
    rig.system.physical_device("rtp0", "arm", "loopback", &json!({"parts": JOINTS}), "rtp0.fast", None).unwrap_or_else(|r| panic!("{}", text(&r)));
    rig.define(verb(
        "servo",
        &[("read", "t.read_channel"), ("drive", "t.drive"), ("watch", "t.watch")],
        json!({"instantiation_parameters": {"drive.position": ["read.channel"], "drive.effort": ["drive.channel"], "sensed": ["read.y"], "commanded": ["watch.u"]},
               "cells": {"effort": ["watch.y", "drive.u"]},
               "command_lists": lists(&[("start", &["!read", "+read 1ms", "+watch 1ms", "+drive 1ms", "ready"])])}),
    ));
    rig.device_type(json!({"name": "Joint", "verb": "servo", "svvs": {"sensed": {"type_text": "double"}, "commanded": {"type_text": "double"}}}));
    for joint in JOINTS {
        let request = json!({"device_type": "Joint", "source": "rtp0.fast", "arguments": {"drive": {"part": {"device": "arm", "part": joint}}}});
        let request: DeviceRequest = serde_json::from_value(request).unwrap();
        rig.system.device(joint, request).unwrap_or_else(|r| panic!("{}", text(&r)));
    }
    let blocks = [("a", "t.count"), ("b", "t.count")];
    for (name, labels) in [("one", &["a"][..]), ("both", &["a", "b"])] {
        let objects = labels.iter().map(|label| ((*label).to_owned(), json!({"device_type": "Joint"}))).collect::<serde_json::Map<_, _>>();
        let parameters = labels.iter().map(|label| (format!("{label}.commanded"), json!([format!("{label}.y")]))).collect::<serde_json::Map<_, _>>();
        let cells = labels.iter().map(|label| (format!("{label}_total"), json!([format!("{label}.total")]))).collect::<serde_json::Map<_, _>>();
        let counting: Vec<String> = labels.iter().map(|label| format!("+{label} 1ms")).collect();
        let counting: Vec<&str> = counting.iter().map(String::as_str).collect();
        rig.define(verb(
            name,
            &blocks[..labels.len()],
            json!({"objects": objects, "instantiation_parameters": parameters, "cells": cells,
                   "command_lists": lists(&[("start", &counting), ("last", &["+a 1ms", "?2ms", "-a"])]), "initial": "start", "transitions": tau(&["start, halted -> last"])}),
        ));
    }
    rig
}

struct Model {
    rig: Rig,
    made: Vec<(u64, u64)>,
    names: HashMap<u64, String>,
    /// Devices of each instance in `made`.
    joints: Vec<Vec<usize>>,
    all: bool,
    paused: BTreeSet<usize>,
    /// Instances suspended by a separate call.
    by_hand: BTreeSet<u64>,
}

impl Model {
    fn new(link: Link) -> Model {
        let rig = rig(link);
        let of = |verb: &str, arguments: serde_json::Value| {
            rig.create(json!({"verb": verb, "arguments": arguments, "placement": {"*": "rtp0.fast"}, "name": format!("{verb} {arguments}")}))
        };
        let made = vec![
            of("one", json!({"a": {"device": "j1"}})),
            of("one", json!({"a": {"device": "j2"}})),
            of("both", json!({"a": {"device": "j1"}, "b": {"device": "j2"}})),
        ];
        let names = made.iter().map(|id| (*id, rig.system.instance_about(*id).unwrap().name)).collect();
        let made = made.into_iter().map(|id| (id, 0)).collect();
        let model = Model { rig, made, names, joints: vec![vec![0], vec![1], vec![0, 1]], all: false, paused: BTreeSet::new(), by_hand: BTreeSet::new() };
        model.enable();
        model
    }

    fn enable(&self) {
        for joint in JOINTS {
            self.rig.system.enable(joint).unwrap_or_else(|r| panic!("{}", text(&r)));
            let until_ns = Some(self.rig.system.now_ns() + 1_000 * MS);
            assert!(matches!(self.rig.system.wait_enabled(joint, until_ns, LONG).unwrap(), WaitResult::Done(true)));
        }
    }

    fn covers(&self, which: usize) -> bool {
        self.all || self.joints[which].iter().any(|joint| self.paused.contains(joint))
    }

    fn state(&self, which: usize) -> &'static str {
        self.rig.system.state(self.made[which].0)
    }

    fn scope(joint: Option<usize>) -> Option<Vec<String>> {
        joint.map(|joint| vec![JOINTS[joint].to_owned()])
    }

    fn carry_out(&mut self, call: Call) {
        let system = &self.rig.system;
        match call {
            Call::Start { which, time_limit_ms } => {
                let limits = Limits { time_limit_ns: time_limit_ms.map(|ms| i64::from(ms) * MS), overruns: None, age_max_ns: None };
                match self.rig.try_start(self.made[which].0, json!({}), limits) {
                    Ok(()) => {
                        self.made[which].1 += 1;
                        self.by_hand.remove(&self.made[which].0);
                        assert_eq!(self.state(which), if self.covers(which) { "suspended" } else { "running" });
                    }
                    Err(refusals) => assert!(matches!(refusals[0].class, Class::InvalidState | Class::SecondWriter), "{}", text(&refusals)),
                }
            }
            Call::Halt(which) => {
                // A suspended instance may continue to the list for a halt.
                if system.halt(self.made[which].0).is_ok() {
                    self.by_hand.remove(&self.made[which].0);
                    // A halt leads to its own list, even during a pause.
                    assert!(self.rig.wait_for(self.made[which].0, 100).is_some());
                }
            }
            Call::Suspend(which) => {
                if system.suspend(self.made[which].0).is_ok() && self.state(which) == "suspended" {
                    self.by_hand.insert(self.made[which].0);
                }
            }
            Call::Resume(which) => {
                if system.resume(self.made[which].0).is_ok() {
                    assert!(!self.covers(which), "resumed under a pause");
                    self.by_hand.remove(&self.made[which].0);
                }
            }
            Call::Pause(joint) => {
                let stopped = system.pause(Self::scope(joint).as_deref()).unwrap_or_else(|r| panic!("{}", text(&r)));
                let ids: Vec<u64> = stopped.iter().map(|(id, _)| *id).collect();
                assert!(matches!(system.paused(&ids, LONG).unwrap(), WaitResult::Done(())));
                match joint {
                    Some(joint) => self.paused.extend([joint]),
                    None => self.all = true,
                }
            }
            Call::Unpause(joint) => {
                system.resume_program(Self::scope(joint).as_deref()).unwrap_or_else(|r| panic!("{}", text(&r)));
                match joint {
                    Some(joint) => self.paused.retain(|paused| *paused != joint),
                    None => (self.all, self.paused) = (false, BTreeSet::new()),
                }
            }
            Call::Disable(joint) => {
                assert!(matches!(system.disable(JOINTS[joint], LONG).unwrap(), WaitResult::Done(())));
                assert!((0..3).filter(|which| self.joints[*which].contains(&joint)).all(|which| matches!(self.state(which), "created" | "ended")));
                self.enable();
            }
            Call::EmergencyStop => {
                system.emergency_stop("tested").unwrap();
                system.advance(2 * MS).unwrap();
                assert!((0..3).all(|which| matches!(self.state(which), "created" | "ended")));
                system.reset().unwrap();
                (self.all, self.paused) = (false, BTreeSet::new());
                self.enable();
            }
            Call::Advance(ms) => self.rig.advance(i64::from(ms)),
        }
        self.check();
    }

    /// Checks that paused instances do not run and their devices do not move as time passes.
    fn check(&self) {
        let still: Vec<usize> = (0..3).filter(|which| self.covers(*which)).collect();
        for &which in &still {
            assert_ne!(self.state(which), "running", "{} runs under a pause", self.names[&self.made[which].0]);
        }
        for id in &self.by_hand {
            assert_ne!(self.rig.system.state(*id), "running", "{} was suspended by hand", self.names[id]);
        }
        if self.all {
            let commanded = || JOINTS.map(|joint| self.rig.read(&format!("{joint}.commanded")));
            let before = commanded();
            self.rig.advance(3);
            assert_eq!(commanded(), before);
        }
    }

    fn close(self) {
        self.rig.system.resume_program(None).unwrap_or_else(|r| panic!("{}", text(&r)));
        for (id, starts) in &self.made {
            for _ in 0..2 {
                // It may have ended meanwhile.
                let _halted = self.rig.system.halt(*id);
            }
            if *starts > 0 {
                assert_eq!(self.rig.wait_for(*id, 1_000).expect("it was halted twice").start, *starts);
            }
            let count = |kind| self.rig.system.log_since(0).iter().filter(|e| e.kind == kind && e.about == self.names[id]).count() as u64;
            assert_eq!((count("start"), count("end")), (*starts, *starts));
            self.rig.system.delete(*id).unwrap_or_else(|r| panic!("{}", text(&r)));
        }
    }
}

fn check(link: Link, calls: &[Call]) {
    let mut model = Model::new(link);
    calls.iter().for_each(|call| model.carry_out(*call));
    model.close();
}

#[test]
fn a_pause_while_a_start_is_under_way_and_a_resume_before_it_is_done() {
    let model = Model::new(Link::Memory);
    let id = model.made[0].0;
    model.rig.start(id);
    let stopped = model.rig.system.pause(None).unwrap();
    assert_eq!(stopped.len(), 1);
    // The pause is revoked before the kernels have executed it.
    assert_eq!(model.rig.system.resume_program(None).unwrap().len(), 1);
    model.rig.advance(5);
    assert_eq!(model.rig.system.state(id), "running");
    model.rig.system.halt(id).unwrap();
    assert_eq!(model.rig.wait(id).command_list, "last");
}

#[test]
fn a_start_that_is_held_back_and_halted_does_not_begin_where_the_pause_is_taken_back_before_its_end() {
    let model = Model::new(Link::Memory);
    let id = model.made[0].0;
    model.rig.system.pause(None).unwrap();
    model.rig.start(id);
    model.rig.system.halt(id).unwrap();
    // The end is in progress and has not been awaited.
    model.rig.system.resume_program(None).unwrap();
    model.rig.advance(5);
    assert_eq!((model.rig.system.state(id), model.rig.wait(id).condition.as_str()), ("ended", "halted"));
    let commanded = model.rig.read("j1.commanded");
    model.rig.advance(5);
    assert_eq!(model.rig.read("j1.commanded"), commanded, "nothing of it runs");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, max_shrink_iters: 4_000, ..ProptestConfig::default() })]

    #[test]
    fn what_is_paused_stands_still_over_memory(calls in prop::collection::vec(call(), 1..50)) {
        check(Link::Memory, &calls);
    }

    #[test]
    fn what_is_paused_stands_still_over_faulty_messages(seed in 0..1000u64, calls in prop::collection::vec(call(), 1..50)) {
        check(Link::Faulty(seed), &calls);
    }
}
