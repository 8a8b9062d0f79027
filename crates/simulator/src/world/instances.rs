// SPDX-License-Identifier: Apache-2.0
//! Calls on verb instances: create, start, wait, halt, delete.
use super::{INSTANCES, Pending, World};
use crate::broken::{BrokenInvariant, broken, text};
use crate::lives::{Claim, Life};
use crate::operations::{CALLERS, Operation};
use crate::program::{ARBITRATED, ARRAYS, JOINT, Kind, MS, PAIRS, Program, Verb};
use crate::seed::Numbers;
use api::CallResult;
use model::refusal::{Class, Refusals};
use serde_json::{Map, Value as Json, json};
use std::time::Duration;

impl World {
    pub fn create(&mut self, of: Operation) -> String {
        if self.made().len() >= INSTANCES {
            return "enough instances".to_owned();
        }
        let index = self.defined[of.a % self.defined.len()];
        let verb = self.program.verbs[index].clone();
        self.last_name += 1;
        let name = format!("i{}", self.last_name);
        let (arguments, life) = self.arguments(&verb, index, &mut Numbers::of(of.b as u64));
        let placement: Map<String, Json> = (verb.placement.iter())
            .map(|(label, source)| {
                // Producers may run on another timer, which their intervals may not fit.
                let timers: Vec<usize> = (0..self.program.sources.len()).filter(|index| self.program.sources[*index].period_ns.is_some()).collect();
                let is_moved = of.c.is_multiple_of(5) && label.starts_with('p');
                let source = if is_moved { timers[of.c / 5 % timers.len()] } else { *source };
                (label.clone(), json!(self.program.sources[source].name))
            })
            .collect();
        let words = format!("create '{name}' of '{}' with {} at {}", verb.name, Json::from(arguments.clone()), Json::from(placement.clone()));
        let (answer, result) = self.told("create", json!({"verb": verb.name, "name": name, "arguments": arguments, "placement": placement}));
        if let Some(id) = result.ok().and_then(|id| id.as_u64()) {
            let sources = placement.values().filter_map(|at| self.program.sources.iter().position(|source| *at == source.name)).collect();
            self.lives.of.insert(name, Life { id, sources, ..life });
        }
        format!("{words}: {answer}")
    }

    /// Returns arguments for a verb's parameters, and the resulting claims.
    fn arguments(&self, verb: &Verb, index: usize, draw: &mut Numbers) -> (Map<String, Json>, Life) {
        let (mut arguments, mut life) = (Map::new(), Life { verb: index, ..Life::default() });
        let pools = Program::pairs();
        // A pair used by one parameter is not available to another.
        let mut free: Vec<usize> = (0..PAIRS + ARBITRATED.len()).collect();
        for (place, parameter) in verb.parameters.iter().enumerate() {
            let name = &parameter.name;
            let mut claim = |what: String, refuses: bool| life.claims.push(Claim { what, refuses });
            match parameter.kind {
                Kind::Pair | Kind::Reads => {
                    // The joint's pair may be written by its own users only; any block may read it.
                    let at = if parameter.kind == Kind::Pair { free.remove(draw.below(free.len())) } else { draw.below(pools.len()) };
                    for half in ["a", "b"] {
                        let svv = format!("{}.{half}", pools[at]);
                        arguments.insert(format!("{name}{half}"), json!({"svv": svv}));
                        if parameter.kind == Kind::Pair {
                            claim(format!("SVV '{svv}'"), at < PAIRS);
                        }
                    }
                }
                Kind::Array => {
                    let svv = format!("v{}", (draw.below(ARRAYS) + place) % ARRAYS);
                    arguments.insert(name.clone(), json!({"svv": svv}));
                    claim(format!("SVV '{svv}'"), true);
                }
                Kind::Channel => {
                    let output = (draw.below(2) + place) % (self.program.plant.1 - 1);
                    arguments.insert(name.clone(), json!({"channel": {"device": "plant", "channel": format!("p{output}.actuator")}}));
                    claim(format!("channel {output}"), true);
                }
                Kind::Object => {
                    arguments.insert(name.clone(), json!({"device": JOINT}));
                    ["a", "b"].iter().for_each(|half| claim(format!("SVV '{JOINT}.{half}'"), true));
                    life.devices.push(JOINT);
                }
            }
        }
        (arguments, life)
    }

    pub fn start(&mut self, of: Operation) -> Result<String, BrokenInvariant> {
        let Some((name, id)) = self.pick(of.a) else { return Ok("nothing to start".to_owned()) };
        let verb = self.program.verbs[self.lives.of[&name].verb].clone();
        self.last_tag += 1;
        let tag = self.last_tag;
        let mut values = json!({"tag": tag});
        for (index, (input, most)) in verb.inputs.iter().enumerate() {
            if (of.b >> index).is_multiple_of(2) {
                values[*input] = json!(1 + (of.b / 7 + index) as u64 % most);
            }
        }
        let limits = json!({"time_limit_ns": of.c.is_multiple_of(5).then(|| (1 + of.c / 5 % 20) as i64 * MS), "overruns": of.c.is_multiple_of(7).then_some(3)});
        let before = self.system.state(id);
        let life = &self.lives.of[&name];
        let conflict = self.lives.of.values().filter(|other| other.is_busy() && other.id != id).find_map(|other| {
            let shared = other.claims.iter().find(|claim| life.has_claim(&claim.what) && claim.refuses)?;
            Some(shared.what.clone())
        });
        self.lives.of[&name].tags.push(tag);
        self.lives.runs.insert(tag, (name.clone(), None));
        let (answer, result) = self.told("start", json!({"instance": id, "values": values, "limits": limits}));
        let words = format!("start '{name}' with {values}, {limits}: {answer}");
        match result {
            Ok(_) => {
                self.lives.of[&name].accepted += 1;
                if !matches!(before, "created" | "ended") {
                    return broken("life of an instance", format!("{words}, while it was {before}"));
                }
                if let Some(claim) = conflict {
                    self.catch_up()?;
                    // The holder may have ended in this very call.
                    if let Some(shared) = self.lives.shared_claim() {
                        return broken("one writer", format!("{words}; {claim}: {shared}"));
                    }
                }
            }
            Err(refusals) => {
                self.lives.of[&name].tags.pop();
                self.lives.runs.remove(&tag);
                if let Some(why) = self.unfounded(&name, &refusals, before, conflict) {
                    return broken("every start that is possible", format!("{words}; {why}"));
                }
            }
        }
        Ok(words)
    }

    /// Returns the reason why refusing a start was unjustified; `None` if it was justified.
    fn unfounded(&self, name: &str, refusals: &Refusals, before: &str, conflict: Option<String>) -> Option<String> {
        let life = &self.lives.of[name];
        let statistics = || self.system.statistics();
        let stands = |source: &usize| {
            let name = &self.program.sources[*source].name;
            self.stalled_ns[*source] > 0 || self.lives.lost.contains(name) || statistics().sources.get(name).is_some_and(|source| source.stopped)
        };
        let is_founded = match refusals[0].class {
            Class::SecondWriter => conflict.is_some(),
            Class::EmergencyStopped => self.system.latched().is_some(),
            Class::NotEnabled => life.devices.iter().any(|device| !matches!(self.system.device_state(device), Ok("standstill" | "moving"))),
            Class::InvalidState => !matches!(before, "created" | "ended") || life.sources.iter().any(stands) || self.is_away(),
            Class::DeviceFailed => self.is_away(),
            _ => false,
        };
        (!is_founded).then(|| format!("it was {before}, and nothing of that is so"))
    }

    /// Returns true if the plant is lost.
    pub fn is_away(&self) -> bool {
        self.system.statistics().physical_devices.get("plant").is_some_and(|plant| plant.lost.is_some())
    }

    pub(crate) fn transit(&mut self, of: Operation, call: &str, from: &str, to: &[&str]) -> Result<String, BrokenInvariant> {
        let Some((name, id)) = self.pick(of.a) else { return Ok(format!("nothing to {call}")) };
        let before = self.system.state(id);
        let (answer, result) = self.told(call, json!({"instance": id}));
        let after = self.system.state(id);
        let words = format!("{call} '{name}': {answer}");
        let is_right = match result {
            Ok(_) => before == from && to.contains(&after),
            // The call itself waits, and the instance may have ended meanwhile.
            Err(refusals) => matches!(refusals[0].class, Class::InvalidState | Class::EmergencyStopped | Class::SecondWriter),
        };
        if is_right { Ok(words) } else { broken("life of an instance", format!("{words}; it was {before} and is {after}")) }
    }

    pub(crate) fn halt(&mut self, of: Operation) -> Result<String, BrokenInvariant> {
        let Some((name, id)) = self.pick(of.a) else { return Ok("nothing to halt".to_owned()) };
        let before = self.system.state(id);
        let is_second = of.b.is_multiple_of(3);
        let words = self.begin(of.caller, "halt", json!({"instance": id, "timeout_ns": (1 + of.c % 20) as i64 * MS}));
        let words = if is_second { format!("{words}; a second time: {:?}", self.system.halt(id).map_err(|why| text(&why))) } else { words };
        if words.contains("refused") && matches!(before, "running" | "suspended" | "queued") {
            return broken("stopping is always possible", format!("{words}; '{name}' was {before}"));
        }
        Ok(words)
    }

    pub(crate) fn wait(&mut self, of: Operation) -> String {
        let Some((_, id)) = self.pick(of.a) else { return "nothing to wait for".to_owned() };
        self.begin(of.caller, "wait", json!({"instance": id, "timeout_ns": (of.b % 30) as i64 * MS}))
    }

    pub(crate) fn wait_shortly(&mut self, of: Operation) -> String {
        let Some((name, id)) = self.pick(of.a) else { return "nothing to wait for".to_owned() };
        let ms = of.b % 10;
        format!("wait for '{name}', {ms} ms at the most: {}", self.told("wait", json!({"instance": id, "timeout_ns": ms as i64 * MS})).0)
    }

    /// Starts a long call, and continues it while other callers act.
    pub(crate) fn begin(&mut self, caller: usize, call: &'static str, arguments: Json) -> String {
        let words = format!("caller {caller}: {call} {arguments}");
        let answer = self.go_on(caller, call, &arguments);
        format!("{words}: {answer}")
    }

    fn go_on(&mut self, caller: usize, call: &'static str, arguments: &Json) -> String {
        match api::begin(&self.system, call, &arguments.to_string(), Duration::ZERO) {
            Ok(CallResult::Done(value)) => value.to_string().chars().take(160).collect(),
            Ok(CallResult::Waiting { call, arguments }) => {
                self.pending[caller] = Some(Pending { call, arguments });
                "waits".to_owned()
            }
            Err(why) => format!("refused: {}", text(&why)),
        }
    }

    /// Polls the waits of all callers.
    pub fn poll(&mut self) -> Vec<String> {
        let mut words = Vec::new();
        for caller in 0..CALLERS {
            if let Some(Pending { call, arguments }) = self.pending[caller].take() {
                let answer = self.go_on(caller, call, &arguments);
                if self.pending[caller].is_none() {
                    words.push(format!("caller {caller} waited: {answer}"));
                }
            }
        }
        words
    }

    pub(crate) fn delete(&mut self, of: Operation) -> Result<String, BrokenInvariant> {
        let Some((name, id)) = self.pick(of.a) else { return Ok("nothing to delete".to_owned()) };
        let before = self.system.state(id);
        let (answer, result) = self.told("delete", json!({"instance": id}));
        let words = format!("delete '{name}': {answer}");
        if result.is_ok() != matches!(before, "created" | "ended") {
            return broken("life of an instance", format!("{words}; it was {before}"));
        }
        if result.is_ok() {
            self.catch_up()?;
            self.lives.of[&name].is_deleted = true;
        }
        Ok(words)
    }

    pub(crate) fn set(&mut self, of: Operation) -> String {
        let Some((name, id)) = self.pick(of.a) else { return "nothing to set".to_owned() };
        let verb = &self.program.verbs[self.lives.of[&name].verb];
        let Some((input, most)) = verb.inputs.get(of.b % verb.inputs.len().max(1)) else { return "nothing to set".to_owned() };
        let values = json!({*input: 1 + of.c as u64 % most});
        format!("set {values} of '{name}': {}", self.told("set", json!({"instance": id, "values": values})).0)
    }

    /// Stores a value from the program in an SVV that no block stores.
    pub(crate) fn write(&mut self, of: Operation) -> String {
        let svv = format!("s{}.{}", of.a % PAIRS, ["a", "b"][of.b % 2]);
        format!("write 0.5 to '{svv}': {}", self.told("write", json!({"name": svv, "value": 0.5})).0)
    }

    pub(crate) fn look(&mut self, of: Operation) -> String {
        let call = ["statistics", "names", "installed", "log", "alarms", "verbs", "configuration"][of.a % 7];
        let (answer, _) = self.told(call, json!({}));
        format!("look at {call}: {} characters", answer.len())
    }
}
