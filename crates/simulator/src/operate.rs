// SPDX-License-Identifier: Apache-2.0
//! Executes operations one by one.
use crate::broken::{BrokenInvariant, broken};
use crate::churn::churn;
use crate::operations::{Operation, What};
use crate::plant;
use crate::program::{JOINT, MS};
use crate::world::World;
use interconnect::Faults;
use serde_json::json;

/// Executes an operation; returns a description of it.
pub fn carry_out(world: &mut World, of: Operation) -> Result<String, BrokenInvariant> {
    if world.pending[of.caller].is_some() && !matches!(of.what, What::Advance | What::Step) {
        return Ok("nothing: the caller waits".to_owned());
    }
    let device = [JOINT, "queue", "abort"][of.a % 3];
    Ok(match of.what {
        What::Define => world.define(),
        What::Create => world.create(of),
        What::Start => return world.start(of),
        What::Suspend => return world.transit(of, "suspend", "running", &["suspended", "ended"]),
        What::Resume => return world.transit(of, "resume", "suspended", &["running", "ended"]),
        What::Halt => return world.halt(of),
        What::Wait => world.wait(of),
        What::WaitShortly => world.wait_shortly(of),
        What::Delete => return world.delete(of),
        What::Set => world.set(of),
        What::Write => world.write(of),
        What::Look => world.look(of),
        What::Advance => {
            let duration_ns = (of.a % 5_000) as i64 * 1_000;
            let answer = world.told("advance", json!({"duration_ns": duration_ns})).0;
            format!("advance {} us: {answer}", duration_ns / 1_000)
        }
        What::Step => format!("step: {}", world.told("step", json!({})).0),
        What::Request => {
            let softs: Vec<String> = world.program.sources.iter().filter(|source| source.period_ns.is_none()).map(|source| source.name.clone()).collect();
            let Some(source) = softs.get(of.a % softs.len().max(1)) else { return Ok("nothing to request".to_owned()) };
            format!("request {source}: {}", world.told("request", json!({"source": source})).0)
        }
        What::EmergencyStop => return world.emergency_stop(),
        What::Reset => {
            if !of.a.is_multiple_of(4) {
                let mut ledger = plant::locked(&world.plant);
                (ledger.fails, ledger.gate) = (false, 0.0);
            }
            if of.b.is_multiple_of(2) {
                // An open gate is only noticed at the next reading.
                let _advanced = world.system.advance(6 * MS);
            }
            world.reset()
        }
        What::Enable => format!("enable {device}: {}", world.told("enable", json!({"name": device})).0),
        What::Disable => world.begin(of.caller, "disable", json!({"name": device})),
        What::Pause => {
            let devices = (!of.b.is_multiple_of(2)).then(|| json!([device]));
            world.begin(of.caller, "pause", json!({"devices": devices}))
        }
        What::ResumeProgram => {
            let devices = of.b.is_multiple_of(4).then(|| json!([device]));
            format!("resume the program: {}", world.told("resume_program", json!({"devices": devices})).0)
        }
        What::Link => world.change_faults(of),
        What::Plant => {
            let mut ledger = plant::locked(&world.plant);
            ledger.fails = !ledger.fails;
            format!("the plant {}", if ledger.fails { "goes away" } else { "comes back" })
        }
        What::Gate => {
            let mut ledger = plant::locked(&world.plant);
            ledger.gate = 1.0 - ledger.gate;
            format!("the gate reads {}", ledger.gate)
        }
        What::Hit => return world.hit(of),
        What::Abandon => {
            let ids: Vec<u64> = world.made().iter().map(|name| world.lives.of[name].id).filter(|id| (of.a as u64 >> (id % 16)) & 1 == 1).collect();
            let done = world.system.abandon(&ids, "somebody");
            format!("the programming system of {ids:?} is cut off: {done:?}")
        }
        What::Churn => return churn(world, of),
    })
}

impl World {
    fn emergency_stop(&mut self) -> Result<String, BrokenInvariant> {
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

    /// Kills or suspends one or two of the processes that watch each other. The consequences take seconds, during which the system's
    /// clock does not advance. Heartbeats still occur every 20 ms, because they do not depend on firings.
    fn hit(&mut self, of: Operation) -> Result<String, BrokenInvariant> {
        let now_ns = self.hearts_ns;
        let still = |choice: usize| (!choice.is_multiple_of(3)).then_some([60, 300, 2_000, 30_000][choice / 3 % 4] * MS);
        let mut words = self.watching.hit(of.a, still(of.b), of.c.is_multiple_of(2), now_ns);
        if of.c / 2 % 2 == 1 {
            words += "; ";
            words += &self.watching.hit(of.a / 3, still(of.b / 16), (of.c / 4).is_multiple_of(2), now_ns);
        }
        // Failures meanwhile occur with outputs that are not safe.
        let until_ns = now_ns + 6_000 * MS;
        let mut at_ns = now_ns;
        while at_ns < until_ns {
            at_ns += 20 * MS;
            self.watching.look(&self.plant, at_ns)?;
        }
        self.hearts_ns = until_ns;
        let is_driven = self.watching.is_driven(until_ns);
        // The machine is restarted: devices that were away return as lost devices.
        self.watching.mend(&self.plant, until_ns);
        if !is_driven {
            plant::locked(&self.plant).fails = true;
            words += "; the plant went away with its process";
        }
        Ok(words)
    }
}
