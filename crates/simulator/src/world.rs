// SPDX-License-Identifier: Apache-2.0
//! A system under the virtual clock, with a program, callers and a plant, and its expected state.
mod instances;

use crate::broken::{BrokenInvariant, broken, text};
use crate::lives::Lives;
use crate::memory::counted;
use crate::operations::CALLERS;
use crate::plant::{self, SharedLedger};
use crate::program::{ARBITRATED, Carrier, JOINT, MS, Program, device_types, servo, svvs};
use crate::seed::Numbers;
use crate::watching::Watching;
use crate::{blocks, crashing};
use interconnect::{Faults, Memory, Message};
use model::refusal::Refusals;
use runtime::ClockKind;
use serde_json::{Value as Json, json};
use std::time::Duration;
use supervisor::System;

/// Maximum number of simultaneous instances.
const INSTANCES: usize = 8;
/// Time limit that is never reached under the virtual clock.
const LONG: Duration = Duration::from_secs(20);

/// Wait that a caller has started.
pub(crate) struct Pending {
    call: &'static str,
    arguments: Json,
}

pub struct World {
    pub system: System,
    pub program: Program,
    pub plant: SharedLedger,
    pub lives: Lives,
    pub draw: Numbers,
    pub watching: Watching,
    pub(crate) message: Option<Message>,
    /// Number of verbs that were tried; `defined` lists the verbs that are defined.
    tried: usize,
    defined: Vec<usize>,
    pub(crate) pending: [Option<Pending>; CALLERS],
    last_tag: i64,
    last_name: usize,
    /// Positions up to which the log and the end reports have been read.
    pub log_read: u64,
    pub ends_read: u64,
    /// Time until which each source is stalled.
    pub stalled_ns: Vec<i64>,
    /// Time since which each output has been unclaimed.
    pub free_since: Vec<Option<i64>>,
    /// Clock of the processes that watch each other.
    pub(crate) hearts_ns: i64,
    /// Number of allocations by the system during calls.
    pub work: u64,
    /// Description of the world's creation.
    pub story: Vec<String>,
    /// Number of accepted calls and number of refused calls.
    pub counts: (usize, usize),
}

impl World {
    pub fn new(numbers: &Numbers) -> Result<World, BrokenInvariant> {
        let program = Program::random(numbers);
        let message = if let Carrier::Message(seed) = program.carrier { Some(Message::new(seed, Faults::none())) } else { None };
        let carrier: Box<dyn interconnect::Carrier> = match &message {
            Some(message) => Box::new(message.clone()),
            None => Box::new(Memory),
        };
        let system = System::new("world", ClockKind::Virtual { seed: program.clock_seed }, carrier).map_err(|why| unmade("the system", &why))?;
        let plant = plant::ledger("plant");
        let sources = program.sources.len();
        let outputs = program.plant.1;
        let draw = numbers.split("arguments");
        let mut world = World {
            system,
            plant,
            lives: Lives::default(),
            draw,
            watching: Watching::new(),
            message,
            tried: 0,
            defined: Vec::new(),
            pending: Default::default(),
            last_tag: 1,
            last_name: 0,
            log_read: 0,
            ends_read: 0,
            stalled_ns: vec![i64::MIN; sources],
            free_since: vec![Some(0); outputs],
            hearts_ns: 0,
            work: 0,
            story: Vec::new(),
            counts: (0, 0),
            program,
        };
        world.configure().map_err(|why| unmade("the program", &why))?;
        Ok(world)
    }

    fn configure(&mut self) -> Result<(), Refusals> {
        let system = &self.system;
        let mut made: Vec<&str> = Vec::new();
        for source in &self.program.sources {
            if !made.contains(&source.processor.as_str()) {
                self.call("processor", json!({"name": source.processor}))?;
                made.push(&source.processor);
            }
            let name = source.name.rsplit('.').next();
            let kind = if source.period_ns.is_some() { "timer" } else { "software" };
            let arguments = json!({"processor": source.processor, "name": name, "kind": kind, "period_ns": source.period_ns.unwrap_or(0), "priority": source.priority, "virtual_cost_ns": source.cost_ns});
            self.call("source", arguments)?;
        }
        system.enter("sim", &blocks::all(), &[])?;
        system.enter("crashing", &crashing::all(), &[])?;
        let at = &self.program.sources[self.program.plant.0];
        let options = json!({"name": "plant", "outputs": self.program.plant.1});
        self.call("physical_device", json!({"processor": at.processor, "name": "plant", "kind": plant::KIND, "options": options, "source": at.name}))?;
        self.call("emergency_stop_input", json!({"device": "plant", "channel": "gate"}))?;
        for (name, mut request) in svvs() {
            request["name"] = json!(name);
            self.call("svv", request)?;
        }
        self.call("define_verb", servo(at.period_ns))?;
        for of in device_types() {
            self.call("define_device_type", of)?;
        }
        for device in ARBITRATED {
            self.call("device", json!({"name": device, "device_type": device}))?;
        }
        let part = json!({"drive": {"part": {"device": "plant", "part": format!("p{}", self.program.plant.1 - 1)}}});
        self.call("device", json!({"name": JOINT, "device_type": "Joint", "source": at.name, "arguments": part}))?;
        for _ in 0..self.program.begins_with {
            let words = self.define();
            self.story.push(words);
        }
        Ok(())
    }

    pub fn call(&self, name: &str, arguments: Json) -> Result<Json, Refusals> {
        api::call(&self.system, name, &arguments.to_string())
    }

    /// Makes a call; returns a description of it and its result. Counts refusals.
    pub fn told(&mut self, name: &str, arguments: Json) -> (String, Result<Json, Refusals>) {
        let arguments = arguments.to_string();
        let (system, work) = (&self.system, &mut self.work);
        let result = counted(work, || api::call(system, name, &arguments));
        let words = match &result {
            Ok(Json::Null) => "done".to_owned(),
            Ok(value) => value.to_string().chars().take(200).collect(),
            Err(why) => format!("refused: {}", text(why)),
        };
        if result.is_ok() {
            self.counts.0 += 1
        } else {
            self.counts.1 += 1
        }
        (words, result)
    }

    pub(crate) fn define(&mut self) -> String {
        let Some(verb) = self.program.verbs.get(self.tried) else { return "every verb is defined".to_owned() };
        let (name, definition) = (verb.name.clone(), verb.definition.clone());
        let (answer, result) = self.told("define_verb", definition);
        if result.is_ok() {
            self.defined.push(self.tried);
        }
        self.tried += 1;
        format!("define '{name}': {answer}")
    }

    /// Returns the names of the existing instances.
    pub fn made(&self) -> Vec<String> {
        self.lives.of.iter().filter(|(_, life)| life.id != 0 && !life.is_deleted).map(|(name, _)| name.clone()).collect()
    }

    fn pick(&self, which: usize) -> Option<(String, u64)> {
        let made = self.made();
        let name = made.get(which % made.len().max(1))?;
        Some((name.clone(), self.lives.of[name].id))
    }

    /// Reads the new log entries.
    pub fn catch_up(&mut self) -> Result<(), BrokenInvariant> {
        let entries = self.system.log_since(self.log_read);
        if let Some(last) = entries.last().filter(|_| entries[0].sequence > self.log_read) {
            // The log keeps only the last entries, and command lists that lead to each other fill it.
            let system = &self.system;
            self.log_read = last.sequence + 1;
            self.lives.lose(|id| system.state(id));
            return Ok(());
        }
        for entry in entries {
            self.log_read = entry.sequence + 1;
            self.lives.read(&entry).or_else(|why| broken("one end for each start", why))?;
        }
        Ok(())
    }

    /// Waits at most `ms` of the system's clock for the instance to end; returns true if it has ended.
    pub fn has_ended_within(&self, id: u64, ms: i64) -> Result<bool, Refusals> {
        let until_ns = self.system.now_ns() + ms * MS;
        Ok(matches!(self.system.wait(id, Some(until_ns), LONG)?, supervisor::WaitResult::Done(_)))
    }
}

fn unmade(what: &str, why: &Refusals) -> BrokenInvariant {
    BrokenInvariant { invariant: "the world can be made", text: format!("{what}: {}", text(why)) }
}
