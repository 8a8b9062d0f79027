// SPDX-License-Identifier: Apache-2.0
//! The pause of a program: every action on devices is suspended, what keeps devices going runs on, and what is started meanwhile
//! is held back: it has its claims and its inputs, and begins when the pause is over.
//!
//! A pause is of the whole system or of some logical devices. What a pause suspended goes on when no pause covers it any more;
//! what somebody suspended himself stays suspended.
use crate::core::Core;
use crate::instance::{Cause, Instance, State};
use crate::refuse::invalid_state;
use crate::system::{System, Waited};
use model::plan::Target;
use model::refusal::Refusals;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// What is paused, and whom that stopped.
#[derive(Default)]
pub(crate) struct Pause {
    all: bool,
    devices: BTreeSet<String>,
    /// Instances that a pause suspended, or is about to.
    suspended: BTreeSet<u64>,
    /// Instances that were started under a pause, with the values of their ψ.
    held_back: BTreeMap<u64, Vec<(Target, Vec<u8>)>>,
}

impl Pause {
    /// Nothing is paused any more: the emergency stop has ended it all.
    pub fn clear(&mut self) {
        (self.all, self.devices) = (false, BTreeSet::new());
    }

    /// Whether it is started, but has not begun.
    pub fn is_held_back(&self, id: u64) -> bool {
        self.held_back.contains_key(&id)
    }

    /// `true`, `false`, or the devices that are paused.
    pub fn shown(&self) -> serde_json::Value {
        if self.devices.is_empty() || self.all { self.all.into() } else { self.devices.iter().cloned().collect::<Vec<_>>().into() }
    }

    /// An action on devices that a pause is about.
    fn covers(&self, instance: &Instance) -> bool {
        instance.is_action() && (self.all || instance.plan.devices.iter().any(|device| self.devices.contains(device)))
    }
}

impl Core {
    /// Pauses the actions on these logical devices, or all actions on devices. The instances that it suspends.
    pub fn pause(&mut self, devices: Option<&[String]>) -> Result<Vec<u64>, Refusals> {
        for device in devices.unwrap_or_default() {
            self.logical(device)?;
        }
        self.refuse_emergency("pause", "the program")?;
        match devices {
            None => self.pause.all = true,
            Some(devices) => self.pause.devices.extend(devices.iter().cloned()),
        }
        let runs = |i: &&Instance| i.state == State::Running && i.ending.is_none() && !i.suspending && self.pause.covers(i);
        let running: Vec<u64> = self.instances.values().filter(runs).map(|i| i.id).collect();
        for &id in &running {
            // A second pause finds those of the first on their way to be suspended.
            if self.pause.suspended.insert(id) {
                self.suspend(id)?;
            }
        }
        self.log.add(self.host.now_ns(), "pause", &scope(devices), self.names(&running));
        Ok(running)
    }

    /// Takes a pause back. The instances that go on, or begin.
    pub fn resume_program(&mut self, devices: Option<&[String]>) -> Result<Vec<u64>, Refusals> {
        for device in devices.unwrap_or_default() {
            self.logical(device)?;
        }
        self.refuse_emergency("resume", "the program")?;
        match devices {
            None => self.pause.clear(),
            Some(devices) => self.pause.devices.retain(|device| !devices.contains(device)),
        }
        let free = |id: &&u64| self.instances.get(*id).is_none_or(|i| !self.pause.covers(i));
        let going: Vec<u64> = self.pause.suspended.iter().filter(free).copied().collect();
        let beginning: Vec<u64> = self.pause.held_back.keys().filter(free).copied().collect();
        for &id in &going {
            self.go_on_after_pause(id);
        }
        for &id in &beginning {
            self.begin_after_pause(id);
        }
        let all = [going, beginning].concat();
        self.log.add(self.host.now_ns(), "resume", &scope(devices), self.names(&all));
        Ok(all)
    }

    /// It was suspended by a pause that is over; one that is not suspended yet goes on as soon as it is.
    pub fn go_on_after_pause(&mut self, id: u64) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        if instance.suspending {
            instance.suspending = false;
            self.pause.suspended.remove(&id);
        } else if instance.state == State::Suspended && !self.pause.covers(&self.instances[&id]) && self.pause.suspended.remove(&id) {
            // It is suspended, and nothing is latched: it goes on.
            let _resumed = self.resume(id);
        }
    }

    /// Holds a start back, where a pause covers it. What it claims is its own already.
    pub fn hold_back(&mut self, id: u64, stores: &[(Target, Vec<u8>)]) -> bool {
        let Some(instance) = self.instances.get(&id).filter(|i| self.pause.covers(i)) else { return false };
        let (name, now_ns) = (instance.name.clone(), self.host.now_ns());
        self.pause.held_back.insert(id, stores.to_vec());
        self.log.add(now_ns, "pause", &name, "its start is held back");
        let instance = self.instances.get_mut(&id).expect("found above");
        instance.state = State::Suspended;
        instance.running.hold(now_ns);
        true
    }

    fn begin_after_pause(&mut self, id: u64) {
        let Some(stores) = self.pause.held_back.remove(&id) else { return };
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        instance.state = State::Running;
        instance.running.go_on(now_ns);
        let opening = self.opening(id, &stores);
        self.append_sequence(id, opening);
    }

    /// A condition ends an instance whose start is held back: nothing of it has run, so nothing of it is asked.
    pub fn end_before_it_began(&mut self, id: u64, condition: usize, message: String, asked_for: bool) {
        let time_ns = self.host.now_ns();
        self.end(id, Cause { condition, block: None, value: None, message, time_ns, asked_for });
    }

    /// The instance has ended: no pause knows it any more.
    pub fn forget_pause(&mut self, id: u64) {
        self.pause.suspended.remove(&id);
        self.pause.held_back.remove(&id);
    }

    /// Refuses to resume one instance of a paused program by itself.
    pub fn refuse_paused(&self, id: u64) -> Result<(), Refusals> {
        match self.instances.get(&id).filter(|i| self.pause.covers(i)) {
            Some(paused) => Err(invalid_state(&format!("'{}'", paused.name), "paused with the program", "resume", "take the pause back where it was made")),
            None => Ok(()),
        }
    }

    fn names(&self, ids: &[u64]) -> String {
        ids.iter().filter_map(|id| Some(self.instances.get(id)?.name.as_str())).collect::<Vec<_>>().join(", ")
    }
}

fn scope(devices: Option<&[String]>) -> String {
    devices.map_or_else(|| "system".to_owned(), |devices| devices.join(", "))
}

impl System {
    /// Pauses; returns, by name, what that suspended. See [`System::paused`] for when it has been done.
    pub fn pause(&self, devices: Option<&[String]>) -> Result<Vec<(u64, String)>, Refusals> {
        self.shared.command(|core| {
            let stopped = core.pause(devices)?;
            Ok(core.named(stopped))
        })
    }

    /// Waits, `slice` of real time at the most, until none of these instances runs.
    pub fn paused(&self, instances: &[u64], slice: Duration) -> Result<Waited<()>, Refusals> {
        self.shared.wait_for(None, slice, |core| {
            let runs = |id: &u64| core.instances.get(id).is_some_and(|i| i.state == State::Running);
            Ok((!instances.iter().any(runs)).then_some(()))
        })
    }

    /// Takes a pause back; returns, by name, what goes on.
    pub fn resume_program(&self, devices: Option<&[String]>) -> Result<Vec<(u64, String)>, Refusals> {
        self.shared.command(|core| {
            let going = core.resume_program(devices)?;
            Ok(core.named(going))
        })
    }
}

impl Core {
    fn named(&self, ids: Vec<u64>) -> Vec<(u64, String)> {
        ids.into_iter().filter_map(|id| Some((id, self.instances.get(&id)?.name.clone()))).collect()
    }
}
