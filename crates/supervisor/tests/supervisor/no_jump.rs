// SPDX-License-Identifier: Apache-2.0
//! No jump: whatever the programming system commands, in whatever order, the output to an actuator changes no faster than its declared
//! slew (except towards the safe value), and the commanded value no faster than the verbs move it. A verb that starts sees the present,
//! never a value of its previous life.
//!
//! There are 50 systems, of a thousand random sequences of commands each. Ten of them run each day, all within five days;
//! `OPENGPAC_JUMPS=all` tries all, `OPENGPAC_SEED` selects the day.
use crate::common::*;
use serde_json::json;
use std::collections::HashSet;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use supervisor::{DeviceRequest, Limits, WaitResult};

const LONG: Duration = Duration::from_secs(300);
/// Slew limit of an effort, per second. It is below the 50 per second that the servo demands at each start (its gain of 50, times a stride
/// per ms), so that the limit acts. The constant below is the maximum step of a set-point per ms.
const SLEW: f64 = 40.0;
const STRIDE: f64 = 0.001;
/// Devices, and the arbitration that each declares.
const JOINTS: [(&str, &str); 2] = [("j1", "abort"), ("j2", "queue")];
/// Verbs on one joint, with their sources.
const VERBS: [(&str, &str); 4] = [("glide", "rtp0.fast"), ("glide", "rtp1.other"), ("turn", "rtp0.fast"), ("turn", "rtp1.other")];

/// Pseudo-random numbers from a seed (xorshift).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

struct Cell {
    rig: Rig,
    /// Instances of verbs on both joints, and the watching one.
    moves: Vec<u64>,
    watching: u64,
    /// Numbers of a joint's traces: positions, and commanded values.
    traces: [(i64, i64); 2],
    /// Times at which a device was enabled, when its commanded value was set to the present one.
    enabled: HashSet<(usize, i64)>,
    /// Last checked rows of each joint: (time, position, commanded).
    rows: [Vec<(i64, f64, f64)>; 2],
}

impl Cell {
    fn new(link: Link, first_trace: i64) -> Cell {
        let rig = Rig::new(link);
        let options = json!({"parts": ["j1", "j2"], "initial": [0.3, -0.2], "slew": SLEW});
        rig.system.physical_device("rtp0", "arm", "loopback", &options, "rtp0.fast", None).unwrap_or_else(|r| panic!("{}", text(&r)));
        rig.define(verb(
            "servo",
            &[("read", "t.read_channel"), ("follow", "t.follow")],
            json!({"instantiation_parameters": {"drive.position": ["read.channel"], "drive.effort": ["follow.channel"], "sensed": ["read.y", "follow.q"], "commanded": ["follow.u"]},
                   "command_lists": lists(&[("start", &["!read", "+read 1ms", "+follow", "ready"]), ("rest", &["+read 1ms", "+follow", "?3ms", "-read", "-follow"])]),
                   "initial": "start", "ending": "rest"}),
        ));
        for (joint, arbitration) in JOINTS {
            rig.device_type(json!({"name": format!("Joint {joint}"), "verb": "servo", "arbitration": arbitration,
                "svvs": {"sensed": {"type_text": "double", "unit": "rad"}, "commanded": {"type_text": "double", "initial": {"copy_of": "sensed"}}}}));
            let request =
                json!({"device_type": format!("Joint {joint}"), "source": "rtp0.fast", "arguments": {"drive": {"part": {"device": "arm", "part": joint}}}});
            let request: DeviceRequest = serde_json::from_value(request).unwrap();
            rig.system.device(joint, request).unwrap_or_else(|r| panic!("{}", text(&r)));
            rig.define(gliding("glide", joint));
            rig.define(gliding("turn", joint));
        }
        let mut moves = Vec::new();
        for (joint, _) in JOINTS {
            for (verb, source) in VERBS {
                moves.push(rig.create(json!({"verb": format!("{verb} {joint}"), "arguments": {"joint": {"device": joint}}, "placement": {"*": source}})));
            }
        }
        let traces = [(first_trace, first_trace + 1), (first_trace + 2, first_trace + 3)];
        let watching = watch(&rig, traces);
        rig.start(watching);
        Cell { rig, moves, watching, traces, enabled: HashSet::new(), rows: [Vec::new(), Vec::new()] }
    }

    fn command(&mut self, numbers: &mut Numbers) -> String {
        // Between two firings: the next one shows the effect of a command, and the speed within a ms is constant.
        self.rig.align();
        let which = self.moves[numbers.below(self.moves.len())];
        let joint = numbers.below(2);
        let system = &self.rig.system;
        match numbers.below(20) {
            0..=5 => {
                let goal = (numbers.below(41) as f64 - 20.0) * 0.001;
                let limits = Limits { time_limit_ns: (numbers.below(4) == 0).then_some(5 * MS), overruns: None, age_max_ns: None };
                let started = self.rig.try_start(which, json!({"goal": goal}), limits);
                return format!("start {which} to {goal}: {:?}", started.map_err(|refusals| refusals[0].class));
            }
            6..=7 => return format!("suspend {which}: {}", system.suspend(which).is_ok()),
            8..=9 => return format!("resume {which}: {}", system.resume(which).is_ok()),
            10..=11 => return format!("halt {which}: {}", system.halt(which).is_ok()),
            12 => {
                let disabled = system.disable(JOINTS[joint].0, LONG);
                assert!(matches!(disabled, Ok(WaitResult::Done(()))), "{joint} is disabled when its users and its own verb have ended");
                return format!("disable {joint}");
            }
            13..=14 => {
                self.enabled.insert((joint, system.now_ns()));
                let enabled = system.enable(JOINTS[joint].0).is_ok() && system.wait_enabled(JOINTS[joint].0, Some(system.now_ns() + 50 * MS), LONG).is_ok();
                return format!("enable {joint}: {enabled}");
            }
            15 if numbers.below(4) == 0 => {
                system.emergency_stop("tested").unwrap();
                return "emergency stop".to_owned();
            }
            16 => {
                system.reset().unwrap();
                if self.rig.system.state(self.watching) == "ended" {
                    self.rig.start(self.watching);
                }
                return "reset".to_owned();
            }
            _ => {}
        }
        let ms = 1 + numbers.below(4) as i64;
        self.rig.advance(ms);
        format!("advance {ms} ms")
    }

    /// Checks all rows since the last call.
    fn check(&mut self, story: &[String]) {
        for (joint, (positions, commanded)) in self.traces.into_iter().enumerate() {
            let (positions, commanded) = (seen(positions), seen(commanded));
            assert_eq!(positions.len(), commanded.len(), "both are traced in each firing");
            self.rows[joint].extend(positions.iter().zip(&commanded).map(|(p, c)| (p.now_ns, p.u, c.u)));
            let rows = &self.rows[joint];
            for w in rows.windows(2).filter(|w| w[1].0 - w[0].0 == MS) {
                let is_new = self.enabled.iter().any(|(of, at)| *of == joint && *at >= w[0].0 && *at <= w[1].0);
                let moved = (w[1].2 - w[0].2).abs();
                // At a hand-over between sources, the last step of one and the first of the other may appear at once.
                assert!(is_new || moved <= 2.0 * STRIDE + 1e-12, "{} was commanded {moved} farther at {} ms: {story:#?}", JOINTS[joint].0, w[1].0 / MS);
            }
            for w in rows.windows(3).filter(|w| w[1].0 - w[0].0 == MS && w[2].0 - w[1].0 == MS) {
                let (before, after) = ((w[1].1 - w[0].1) * 1e3, (w[2].1 - w[1].1) * 1e3);
                let is_safe = after.abs() < 1e-9;
                assert!(
                    is_safe || (after - before).abs() <= SLEW * 1e-3 + 1e-9,
                    "{} jumped from {before} to {after} at {} ms: {story:#?}",
                    JOINTS[joint].0,
                    w[2].0 / MS
                );
            }
            let kept = self.rows[joint].len().saturating_sub(2);
            self.rows[joint].drain(..kept);
            // The rows that are kept are checked again.
            let first_ns = self.rows[joint].first().map_or(i64::MIN, |row| row.0);
            self.enabled.retain(|(of, at)| *of != joint || *at >= first_ns);
        }
    }
}

/// Returns a verb: `glide` moves to its goal and holds it; `turn` moves from there to 0, slows down when it is halted, and rests at every
/// end.
fn gliding(name: &str, joint: &str) -> serde_json::Value {
    let is_turn = name == "turn";
    let mut of = verb(
        &format!("{name} {joint}"),
        &[("glide", "t.glide")],
        json!({"objects": {"joint": {"device_type": format!("Joint {joint}")}}, "instantiation_parameters": {"joint.commanded": ["glide.present", "glide.y"]},
               "input_parameters": {"goal": {"targets": ["glide.goal"]}}, "conditions": {"arrived": {"on": ["glide.there"], "returns": []}},
               "command_lists": lists(&[("go", &["*glide", "+glide 1ms"])])}),
    );
    if is_turn {
        of["blocks"]["back"] = json!({"block": {"subroutine": "t.glide"}});
        of["instantiation_parameters"]["joint.commanded"] = json!(["glide.present", "back.present", "glide.y", "back.y"]);
        of["conditions"]["returned"] = json!({"on": ["back.there"], "returns": [], "during": "back"});
        of["initial"] = json!("go");
        of["command_lists"]["back"] = list(&["*back", "+back 1ms"]);
        of["command_lists"]["last"] = list(&["*back", "+back 1ms", "?3ms", "-back"]);
        of["transitions"] = tau(&["go, arrived -> back", "go, halted -> back", "back, time_limit -> go"]);
        of["ending"] = json!("last");
        of["suspend"] = json!("safe");
    }
    of
}

/// Starts a verb that traces positions and commanded values every ms.
fn watch(rig: &Rig, traces: [(i64, i64); 2]) -> u64 {
    let blocks = [("p1", "t.read_channel"), ("s1", "t.probe"), ("c1", "t.watch"), ("p2", "t.read_channel"), ("s2", "t.probe"), ("c2", "t.watch")];
    rig.define(verb(
        "watch",
        &blocks,
        json!({"instantiation_parameters": {"p1": ["p1.channel"], "p2": ["p2.channel"], "one": ["c1.u"], "two": ["c2.u"]},
               "cells": {"y1": ["p1.y", "s1.u"], "y2": ["p2.y", "s2.u"], "a": ["s1.y"], "b": ["s2.y"], "c": ["c1.y"], "d": ["c2.y"]},
               "input_parameters": {"t1": {"targets": ["s1.trace"], "default": traces[0].0}, "t2": {"targets": ["c1.trace"], "default": traces[0].1},
                                    "t3": {"targets": ["s2.trace"], "default": traces[1].0}, "t4": {"targets": ["c2.trace"], "default": traces[1].1}},
               "command_lists": lists(&[("start", &["+p1 1ms", "+s1", "+c1 1ms", "+p2 1ms", "+s2", "+c2 1ms"])])}),
    ));
    let channel = |part: &str| json!({"channel": {"device": "arm", "channel": format!("{part}.position")}});
    let arguments = json!({"p1": channel("j1"), "p2": channel("j2"), "one": {"svv": "j1.commanded"}, "two": {"svv": "j2.commanded"}});
    rig.create(json!({"verb": "watch", "arguments": arguments, "placement": {"*": "rtp0.fast"}}))
}

/// Number of command sequences in each system; the next is the number of commands in each.
const SEQUENCES: usize = 1_000;
const COMMANDS: usize = 6;

/// Number of systems, and the number of days in which all of them run.
const SYSTEMS: u64 = 50;
const PARTS: u64 = 5;

/// Returns the seeds of today's systems, or of all.
fn seeds() -> impl Iterator<Item = u64> {
    let day = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    let day = std::env::var("OPENGPAC_SEED").map_or_else(|_| day(), |text| text.parse().expect("a number"));
    let is_all = std::env::var("OPENGPAC_JUMPS").is_ok_and(|text| text == "all");
    (1..=SYSTEMS).filter(move |seed| is_all || seed % PARTS == day % PARTS)
}

fn no_jump(link: Link, first_trace: i64) {
    for seed in seeds() {
        let mut numbers = Numbers(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ first_trace as u64);
        let mut cell = Cell::new(link, first_trace);
        let mut story: Vec<String> = Vec::new();
        for sequence in 0..SEQUENCES {
            story.drain(..story.len().saturating_sub(10 * COMMANDS));
            story.push(format!("seed {seed}, sequence {sequence}"));
            for _ in 0..COMMANDS {
                let command = cell.command(&mut numbers);
                story.push(format!("{} ms: {command}", cell.rig.system.now_ns() as f64 * 1e-6));
            }
            cell.check(&story);
        }
        let starts = cell.rig.logged("start").len();
        assert!(starts > 0 && !cell.rig.logged("end").is_empty(), "something was done");
        let limited = cell.rig.system.statistics().physical_devices["arm"].slew_limited;
        assert!(limited > SEQUENCES as u64 / 10, "the slew limit acted only {limited} times");
        cell.rig.system.close();
    }
}

#[test]
fn nothing_jumps_in_random_sequences_of_commands_over_memory() {
    no_jump(Link::Memory, 900);
}

#[test]
fn nothing_jumps_in_random_sequences_of_commands_over_messages() {
    no_jump(Link::Message, 910);
}
