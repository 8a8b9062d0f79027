// SPDX-License-Identifier: Apache-2.0
//! Claims: from start to end, an instance owns everything that it can write, or the start is not admitted. If another instance holds a
//! claim, the start is refused by default. If the logical device concerned declares it, the start is instead queued in the order of the
//! starts, or takes the claim by aborting the holder. A start takes all its claims at once and never holds one while waiting for another,
//! so deadlock is impossible.
use crate::core::Core;
use crate::instances::cause::Cause;
use crate::instances::course::Course;
use crate::instances::instance::State;
use crate::instances::table::Request;
use crate::starting::needs::HeldClaim;
use model::SystemCondition;
use model::definition::Arbitration;
use model::plan::Plan;
use model::refusal::Refusals;
use std::collections::BTreeSet;

/// Outcome of a start's claims.
pub(crate) enum Admission {
    Now,
    /// The start begins after these instances have ended.
    Later(Vec<String>),
}

impl Core {
    /// Decides whether a start may begin immediately, later, or not at all.
    pub fn arbitrate(&mut self, request: &Request) -> Result<Admission, Refusals> {
        let instance = &self.instances[&request.id];
        let (plan, name) = (instance.plan.clone(), instance.name.clone());
        let held = self.instances.held(&self.registry, request, &plan, self.instances.queue.len());
        if held.is_empty() {
            return Ok(Admission::Now);
        }
        let refused: Refusals =
            held.iter().filter(|h| h.arbitration == Arbitration::Refuse).map(|h| self.instances.second_writer(&self.registry, &name, &plan, h)).collect();
        if !refused.is_empty() {
            return Err(refused);
        }
        let mut holders: Vec<u64> = held.iter().map(|h| h.holder).collect();
        holders.sort_unstable();
        holders.dedup();
        if held.iter().all(|h| h.arbitration == Arbitration::Abort) {
            // A later start also replaces queued ones.
            let waiting: Vec<u64> = holders.iter().filter(|h| self.instances[h].state() == State::Queued).copied().collect();
            self.instances.queue.retain(|r| !waiting.contains(&r.id));
            for id in waiting {
                self.course(id).ended_in_queue(SystemCondition::Aborted, &format!("'{name}' was started"));
            }
            holders.retain(|h| self.registry.claims.values().any(|holder| holder == h));
        }
        Ok(Admission::Later(holders.iter().map(|h| self.instances[h].name.clone()).collect()))
    }

    /// Begins queued starts that can begin, in order; aborts holders if a start waits only for them.
    pub fn serve_queue(&mut self) {
        let mut place = 0;
        while let Some(request) = self.instances.queue.get(place) {
            let instance = &self.instances[&request.id];
            let (name, plan) = (instance.name.clone(), instance.plan.clone());
            let held = self.instances.held(&self.registry, request, &plan, place);
            if held.is_empty() {
                let request = self.instances.queue.remove(place);
                self.admit(request);
                continue;
            }
            let running = |h: &HeldClaim| self.instances[&h.holder].state() != State::Queued;
            if held.iter().all(|h| h.arbitration == Arbitration::Abort && running(h)) {
                let holders: BTreeSet<u64> = held.iter().map(|h| h.holder).collect();
                let length = self.instances.queue.len();
                holders.into_iter().for_each(|holder| self.course(holder).abort(&name, &plan));
                if self.instances.queue.len() != length {
                    // A holder ended at once, and the queue was served meanwhile.
                    return;
                }
            }
            place += 1;
        }
    }

    /// Begins a start whose turn has come, provided that its preconditions still hold.
    fn admit(&mut self, request: Request) {
        let instance = &self.instances[&request.id];
        let (id, name) = (instance.id, instance.name.clone());
        match self.check_start(instance) {
            Ok(()) => {
                self.observation.log.add(self.host.now_ns(), "admission", &name, "");
                self.begin(request);
            }
            Err(refusals) => {
                let message = refusals.first().map_or_else(String::new, |r| r.message.clone());
                let condition = if self.safety.emergency.reason.is_some() { SystemCondition::EmergencyStop } else { SystemCondition::Aborted };
                self.course(id).ended_in_queue(condition, &message);
            }
        }
    }
}

impl Course<'_> {
    /// Ends an instance, once, because a later start takes its claims. If that start acts on all devices of the instance, it takes over
    /// immediately; otherwise the instance first comes to rest.
    fn abort(&mut self, by: &str, plan: &Plan) {
        let id = self.id;
        let message = format!("'{by}' was started");
        match self.core.instances.get_mut(&id) {
            Some(instance) if !instance.leaving.aborted => {
                instance.leaving.aborted = true;
                instance.leaving.is_overtaken = instance.plan.devices.iter().all(|device| plan.devices.contains(device));
            }
            _ => return,
        }
        self.end_by(SystemCondition::Aborted, message);
    }

    /// Ends a start that is still queued.
    pub fn leave_queue(&mut self, condition: usize, message: &str, asked_for: bool) {
        let id = self.id;
        self.core.instances.queue.retain(|request| request.id != id);
        self.end_in_queue(condition, message, asked_for);
        self.core.serve_queue();
    }

    fn ended_in_queue(&mut self, condition: SystemCondition, message: &str) {
        let Some(condition) = self.core.instances.get(&self.id).and_then(|instance| instance.system(condition)) else { return };
        self.end_in_queue(condition, message, false);
    }

    fn end_in_queue(&mut self, condition: usize, message: &str, asked_for: bool) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        instance.times.started_ns = now_ns;
        instance.ends(Cause { condition, block: None, value: None, message: message.to_owned(), time_ns: now_ns, asked_for });
        self.ended();
    }
}
