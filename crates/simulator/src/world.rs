// SPDX-License-Identifier: Apache-2.0
//! A system under the virtual clock with a program, callers and a plant, and what is known of it: the operations, carried out one by one.
mod instances;

use crate::lives::Lives;
use crate::operations::{Operation, What};
use crate::plant::{self, Shared};
use crate::program::{ARBITRATED, Carrier, JOINT, MS, Program, device_types, servo, svvs};
use crate::seed::Numbers;
use crate::watching::Watching;
use crate::{blocks, churn};
use interconnect::{Faults, Memory, Message};
use model::refusal::Refusals;
use runtime::ClockKind;
use serde_json::{Value as Json, json};
use std::time::Duration;
use supervisor::System;

/// Who calls at the same time.
pub const CALLERS: usize = 3;
/// Instances at the same time.
const INSTANCES: usize = 8;
/// Nothing under the virtual clock takes as long.
const LONG: Duration = Duration::from_secs(20);

/// An invariant that does not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Broken {
    pub invariant: &'static str,
    pub text: String,
}

pub fn broken<T>(invariant: &'static str, text: impl Into<String>) -> Result<T, Broken> {
    Err(Broken { invariant, text: text.into() })
}

/// A wait that a caller has begun.
struct Pending {
    call: &'static str,
    arguments: Json,
}

pub struct World {
    pub system: System,
    pub program: Program,
    pub plant: Shared,
    pub lives: Lives,
    pub draw: Numbers,
    pub watching: Watching,
    message: Option<Message>,
    /// How many verbs were tried; which of them there are.
    tried: usize,
    defined: Vec<usize>,
    pending: [Option<Pending>; CALLERS],
    last_tag: i64,
    last_name: usize,
    /// Where the log and the end reports were read up to.
    pub log_read: u64,
    pub ends_read: u64,
    /// Until when each source stands still.
    pub stalled_ns: Vec<i64>,
    /// Since when each output has nobody who claims it.
    pub free_since: Vec<Option<i64>>,
    /// The clock of those who watch each other.
    hearts_ns: i64,
    /// Allocations of the system in calls.
    pub work: u64,
    /// How it was made.
    pub story: Vec<String>,
    /// How many calls were accepted, how many refused.
    pub counts: (usize, usize),
}

pub fn text(refusals: &Refusals) -> String {
    refusals.iter().map(|refusal| format!("{:?}: {refusal}", refusal.class)).collect::<Vec<_>>().join("; ")
}

impl World {
    pub fn new(numbers: &Numbers) -> Result<World, Broken> {
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
        system.enter("crashing", &blocks::crashing(), &[])?;
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

    /// A call whose result is told in words; what is refused is counted.
    pub fn told(&mut self, name: &str, arguments: Json) -> (String, Result<Json, Refusals>) {
        let arguments = arguments.to_string();
        let (system, work) = (&self.system, &mut self.work);
        let result = churn::counted(work, || api::call(system, name, &arguments));
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

    fn define(&mut self) -> String {
        let Some(verb) = self.program.verbs.get(self.tried) else { return "every verb is defined".to_owned() };
        let (name, definition) = (verb.name.clone(), verb.definition.clone());
        let (answer, result) = self.told("define_verb", definition);
        if result.is_ok() {
            self.defined.push(self.tried);
        }
        self.tried += 1;
        format!("define '{name}': {answer}")
    }

    /// The instances that are there, by name.
    pub fn made(&self) -> Vec<String> {
        self.lives.of.iter().filter(|(_, life)| life.id != 0 && !life.is_deleted).map(|(name, _)| name.clone()).collect()
    }

    fn pick(&self, which: usize) -> Option<(String, u64)> {
        let made = self.made();
        let name = made.get(which % made.len().max(1))?;
        Some((name.clone(), self.lives.of[name].id))
    }

    pub fn carry_out(&mut self, of: Operation) -> Result<String, Broken> {
        if self.pending[of.caller].is_some() && !matches!(of.what, What::Advance | What::Step) {
            return Ok("nothing: the caller waits".to_owned());
        }
        let device = [JOINT, "queue", "abort"][of.a % 3];
        Ok(match of.what {
            What::Define => self.define(),
            What::Create => self.create(of),
            What::Start => return self.start(of),
            What::Suspend => return self.transit(of, "suspend", "running", &["suspended", "ended"]),
            What::Resume => return self.transit(of, "resume", "suspended", &["running", "ended"]),
            What::Halt => return self.halt(of),
            What::Wait => self.wait(of),
            What::WaitShortly => self.wait_shortly(of),
            What::Delete => return self.delete(of),
            What::Set => self.set(of),
            What::Write => self.write(of),
            What::Look => self.look(of),
            What::Advance => {
                let duration_ns = (of.a % 5_000) as i64 * 1_000;
                let answer = self.told("advance", json!({"duration_ns": duration_ns})).0;
                format!("advance {} us: {answer}", duration_ns / 1_000)
            }
            What::Step => format!("step: {}", self.told("step", json!({})).0),
            What::Request => {
                let softs: Vec<String> = self.program.sources.iter().filter(|source| source.period_ns.is_none()).map(|source| source.name.clone()).collect();
                let Some(source) = softs.get(of.a % softs.len().max(1)) else { return Ok("nothing to request".to_owned()) };
                format!("request {source}: {}", self.told("request", json!({"source": source})).0)
            }
            What::EmergencyStop => return self.emergency_stop(),
            What::Reset => {
                if !of.a.is_multiple_of(4) {
                    let mut ledger = plant::locked(&self.plant);
                    (ledger.fails, ledger.gate) = (false, 0.0);
                }
                if of.b.is_multiple_of(2) {
                    // The gate is seen open when it was read.
                    let _advanced = self.system.advance(6 * MS);
                }
                self.reset()
            }
            What::Enable => format!("enable {device}: {}", self.told("enable", json!({"name": device})).0),
            What::Disable => self.begin(of.caller, "disable", json!({"name": device})),
            What::Pause => {
                let devices = (!of.b.is_multiple_of(2)).then(|| json!([device]));
                self.begin(of.caller, "pause", json!({"devices": devices}))
            }
            What::ResumeProgram => {
                let devices = of.b.is_multiple_of(4).then(|| json!([device]));
                format!("resume the program: {}", self.told("resume_program", json!({"devices": devices})).0)
            }
            What::Link => self.change_faults(of),
            What::Plant => {
                let mut ledger = plant::locked(&self.plant);
                ledger.fails = !ledger.fails;
                format!("the plant {}", if ledger.fails { "goes away" } else { "comes back" })
            }
            What::Gate => {
                let mut ledger = plant::locked(&self.plant);
                ledger.gate = 1.0 - ledger.gate;
                format!("the gate reads {}", ledger.gate)
            }
            What::Hit => return self.hit(of),
            What::Abandon => {
                let ids: Vec<u64> = self.made().iter().map(|name| self.lives.of[name].id).filter(|id| (of.a as u64 >> (id % 16)) & 1 == 1).collect();
                let done = self.system.abandon(&ids, "somebody");
                format!("the programming system of {ids:?} is cut off: {done:?}")
            }
            What::Churn => return churn::churn(self, of),
        })
    }

    fn emergency_stop(&mut self) -> Result<String, Broken> {
        let (answer, result) = self.told("emergency_stop", json!({"reason": "simulated"}));
        if result.is_err() || self.system.latched().is_none() {
            return broken("stopping is always possible", format!("emergency stop: {answer}"));
        }
        Ok("emergency stop".to_owned())
    }

    pub fn reset(&mut self) -> String {
        let (answer, result) = self.told("reset", json!({}));
        if result.is_ok() {
            self.lives.lost.clear();
        }
        format!("reset: {answer}")
    }

    fn change_faults(&mut self, of: Operation) -> String {
        let Some(message) = &self.message else { return "memory has no faults".to_owned() };
        let delay_ns = [0, 100_000, 3 * MS, 20 * MS][of.b % 4];
        let share = |bit: usize| if (of.a >> bit) & 1 == 1 { [0.05, 0.2, 0.5][of.c % 3] } else { 0.0 };
        let link = Faults::delay(delay_ns / 5, delay_ns);
        let faults = Faults { drop: share(0), repeat: share(1), reorder: share(2), corrupt: share(3), retransmit_ns: link.retransmit_ns.max(MS), ..link };
        message.set_faults(faults);
        format!("the messages: delay {} us, drop {}, repeat {}, reorder {}, corrupt {}", delay_ns / 1_000, share(0), share(1), share(2), share(3))
    }

    /// One or two of those who watch each other are hit; what follows takes seconds, in which the system's own time stands: a heart beats
    /// every 20 ms, and firings say nothing about it.
    fn hit(&mut self, of: Operation) -> Result<String, Broken> {
        let now_ns = self.hearts_ns;
        let still = |choice: usize| (!choice.is_multiple_of(3)).then_some([60, 300, 2_000, 30_000][choice / 3 % 4] * MS);
        let mut words = self.watching.hit(of.a, still(of.b), of.c.is_multiple_of(2), now_ns);
        if of.c / 2 % 2 == 1 {
            words += "; ";
            words += &self.watching.hit(of.a / 3, still(of.b / 16), (of.c / 4).is_multiple_of(2), now_ns);
        }
        // What goes wrong meanwhile goes wrong with outputs that are not safe.
        let until_ns = now_ns + 6_000 * MS;
        let mut at_ns = now_ns;
        while at_ns < until_ns {
            at_ns += 20 * MS;
            self.watching.look(&self.plant, at_ns)?;
        }
        self.hearts_ns = until_ns;
        let is_driven = self.watching.is_driven(until_ns);
        // The machine is started again: what was away comes back as a device that was lost.
        self.watching.mend(&self.plant, until_ns);
        if !is_driven {
            plant::locked(&self.plant).fails = true;
            words += "; the plant went away with its process";
        }
        Ok(words)
    }

    /// Reads what the log says since the last time.
    pub fn catch_up(&mut self) -> Result<(), Broken> {
        let entries = self.system.log_since(self.log_read);
        if let Some(last) = entries.last().filter(|_| entries[0].sequence > self.log_read) {
            // The log keeps the last entries only, and lists that lead to each other fill it.
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

    /// Waits at most so many ms of the system's clock until the instance has ended.
    pub fn has_ended_within(&self, id: u64, ms: i64) -> Result<bool, Refusals> {
        let until_ns = self.system.now_ns() + ms * MS;
        Ok(matches!(self.system.wait(id, Some(until_ns), LONG)?, supervisor::Waited::Done(_)))
    }
}

fn unmade(what: &str, why: &Refusals) -> Broken {
    Broken { invariant: "the world can be made", text: format!("{what}: {}", text(why)) }
}
