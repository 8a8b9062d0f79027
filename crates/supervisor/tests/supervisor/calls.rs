// SPDX-License-Identifier: Apache-2.0
//! Checks that calling a verb at once equals its four steps: whatever else happens, both give the same reports and refusals at the same
//! times, the same log and the same values.
use crate::common::*;
use crate::properties::{PLACES, SVVS, VERBS, devices, verbs};
use model::definition::Application;
use proptest::prelude::*;
use serde_json::{Value as Json, json};
use std::collections::HashSet;
use std::time::Duration;
use supervisor::{Limits, Report, WaitResult};

#[derive(Clone, Copy, Debug)]
enum Act {
    /// A call, at once or in four steps.
    Call {
        verb: usize,
        place: usize,
        svv: usize,
        limit: u8,
        time_limit_ms: u8,
    },
    /// An instance that runs concurrently.
    Begin {
        verb: usize,
        place: usize,
        svv: usize,
        time_limit_ms: u8,
    },
    Halt(usize),
    Advance {
        us: u16,
    },
    Write {
        svv: usize,
    },
    EmergencyStop,
    Reset,
}

fn act() -> impl Strategy<Value = Act> {
    let (verb, place, svv) = (0..VERBS.len() + AT_ONCE.len(), 0..PLACES.len(), 0..SVVS.len());
    prop_oneof![
        8 => (verb.clone(), place.clone(), svv.clone(), 0..6u8, 1..9u8)
            .prop_map(|(verb, place, svv, limit, time_limit_ms)| Act::Call { verb, place, svv, limit, time_limit_ms }),
        2 => (verb, place, svv, 1..9u8).prop_map(|(verb, place, svv, time_limit_ms)| Act::Begin { verb, place, svv, time_limit_ms }),
        1 => (0..4usize).prop_map(Act::Halt),
        3 => (0..3_000u16).prop_map(|us| Act::Advance { us }),
        1 => (0..SVVS.len()).prop_map(|svv| Act::Write { svv }),
        1 => Just(Act::EmergencyStop),
        2 => Just(Act::Reset),
    ]
}

/// Verbs whose initial list completes immediately: they end with their first script, or transition from it.
const AT_ONCE: [&str; 4] = ["counts", "breaks", "goes_on", "concludes"];

fn at_once() -> [Json; 4] {
    let of = |name: &str, rest: Json| {
        let mut of = verb(
            name,
            &[("a", "t.count"), ("b", "t.count"), ("p", "t.probe"), ("bad", "t.faulty")],
            json!({"instantiation_parameters": {"s": ["a.y", "p.u"]},
                   "cells": {"at": ["a.total"], "by": ["b.y"], "bt": ["b.total"], "py": ["p.y"], "bady": ["bad.y"]},
                   "input_parameters": {"limit": {"targets": ["a.limit"], "default": 3.0}, "at": {"targets": ["bad.at"], "default": 2}},
                   "output_values": {"a": "a.y", "total": "a.total"}, "initial": "one"}),
        );
        for (key, value) in rest.as_object().unwrap() {
            of[key] = value.clone();
        }
        of
    };
    let conditions = json!({"completed": {"returns": ["a", "total"]}, "a_done": {"on": ["a.reached"], "returns": ["a"]}, "fault": {"returns": ["total"]}});
    [
        of("counts", json!({"command_lists": lists(&[("one", &["!a", "!b", "!a"])]), "conditions": conditions})),
        of(
            "breaks",
            json!({"command_lists": lists(&[("one", &["!a", "!bad", "!bad", "!a"]), ("two", &["!a"])]), "conditions": conditions,
                   "transitions": tau(&["one, fault -> two"])}),
        ),
        of(
            "goes_on",
            json!({"command_lists": lists(&[("one", &["!a"]), ("two", &["!a", "?1ms"])]), "conditions": conditions, "transitions": tau(&["one, completed -> two"])}),
        ),
        of(
            "concludes",
            json!({"command_lists": lists(&[("one", &["!a"]), ("last", &["!b", "?1ms"])]), "conditions": conditions, "ending": "last", "ending_limit_ns": 2 * MS}),
        ),
    ]
}

/// Runs acts and collects everything observable.
struct Witness {
    rig: Rig,
    in_one: bool,
    begun: Vec<u64>,
    seen: Vec<String>,
}

impl Witness {
    fn of(link: Link, acts: &[Act], in_one: bool) -> Witness {
        let rig = Rig::new(link);
        rig.svvs(&["x", "y"]);
        devices(&rig);
        verbs().into_iter().chain(at_once()).for_each(|verb| rig.define(verb));
        let mut witness = Witness { rig, in_one, begun: Vec::new(), seen: Vec::new() };
        acts.iter().for_each(|act| witness.carry_out(*act));
        let entries = witness.rig.system.log_since(0);
        witness.seen.extend(entries.iter().map(|e| format!("{} {} {}: {}", e.time_s, e.kind, e.about, e.text)));
        witness
    }

    fn carry_out(&mut self, act: Act) {
        let system = &self.rig.system;
        match act {
            Act::Call { verb, place, svv, limit, time_limit_ms } => {
                let application = asked(verb, place, svv, limit);
                let limits = Limits { time_limit_ns: Some(i64::from(time_limit_ms) * MS), ..Limits::default() };
                let report = if self.in_one { self.in_one(&application, limits) } else { self.in_four(&application, limits) };
                self.seen.push(report.map_or_else(|refusals| text(&refusals), |report| serde_json::to_string(&report).unwrap()));
            }
            Act::Begin { verb, place, svv, time_limit_ms } => {
                let limits = Limits { time_limit_ns: Some(i64::from(time_limit_ms) * MS), ..Limits::default() };
                if let Ok(id) = system.create(&asked(verb, place, svv, 4)) {
                    self.begun.push(id);
                    let _refused = self.rig.try_start(id, json!({}), limits);
                }
            }
            Act::Halt(which) => {
                if let Some(id) = self.begun.get(which) {
                    let _refused = system.halt(*id);
                }
            }
            Act::Advance { us } => system.advance(i64::from(us) * 1_000).unwrap(),
            Act::Write { svv } => {
                let _held = system.write(SVVS[svv], &model::value::Value::Number(2.5));
            }
            Act::EmergencyStop => system.emergency_stop("tested").unwrap(),
            Act::Reset => drop(system.reset().unwrap()),
        }
        let values = self.rig.read_all(&SVVS);
        self.seen.push(format!("{values:?} at {}", self.rig.system.now_ns()));
    }

    fn in_one(&self, application: &Application, limits: Limits) -> Result<Report, model::refusal::Refusals> {
        let system = &self.rig.system;
        let started = system.start_to_wait(system.create_to_start(application)?, &application.values, limits)?;
        match system.complete(started, Duration::from_secs(60))? {
            WaitResult::Done(report) => Ok(report),
            _ => panic!("a call of at most some ms of virtual time took a minute"),
        }
    }

    fn in_four(&self, application: &Application, limits: Limits) -> Result<Report, model::refusal::Refusals> {
        let id = self.rig.system.create(application)?;
        if let Err(refusals) = self.rig.system.start(id, &application.values, limits) {
            self.rig.system.delete(id)?;
            return Err(refusals);
        }
        let report = self.rig.wait(id);
        self.rig.system.delete(id)?;
        Ok(report)
    }
}

fn asked(verb: usize, place: usize, svv: usize, limit: u8) -> Application {
    let names: Vec<&str> = VERBS.iter().chain(&AT_ONCE).copied().collect();
    let given = format!("s={}", SVVS[svv]);
    let words: Vec<&str> = PLACES[place].iter().copied().chain([given.as_str()]).collect();
    let mut application = application(names[verb], &words);
    application["values"] = json!({"limit": f64::from(limit)});
    serde_json::from_value(application).unwrap()
}

fn check(link: Link, acts: &[Act]) {
    let (one, four) = (Witness::of(link, acts, true), Witness::of(link, acts, false));
    assert_eq!(one.seen, four.seen);
    let (one, four) = (one.rig.system.statistics(), four.rig.system.statistics());
    let steps = |of: &supervisor::Statistics| of.sources.values().map(|source| source.steps).collect::<Vec<_>>();
    assert_eq!(steps(&one), steps(&four));
}

#[test]
fn the_calls_of_this_property_end_in_many_ways() {
    let call = |verb, place, limit| Act::Call { verb, place, svv: 0, limit, time_limit_ms: 8 };
    let acts: Vec<Act> = (0..VERBS.len() + AT_ONCE.len()).flat_map(|verb| [call(verb, 0, 0), call(verb, 0, 1), call(verb, 0, 5), call(verb, 1, 2)]).collect();
    let witness = Witness::of(Link::Memory, &acts, true);
    let ends: HashSet<String> = (witness.seen.iter())
        .filter_map(|line| serde_json::from_str::<Json>(line).ok())
        .filter(Json::is_object)
        .map(|report| format!("{}: {} in {}", report["verb"], report["condition"], report["command_list"]))
        .collect();
    assert!(ends.len() >= 12, "{ends:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, max_shrink_iters: 4_000, ..ProptestConfig::default() })]

    #[test]
    fn a_call_is_its_four_steps_over_memory(acts in prop::collection::vec(act(), 1..30)) {
        check(Link::Memory, &acts);
    }

    #[test]
    fn a_call_is_its_four_steps_over_messages(acts in prop::collection::vec(act(), 1..30)) {
        check(Link::Message, &acts);
    }
}
