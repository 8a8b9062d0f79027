// SPDX-License-Identifier: Apache-2.0
//! Claims: everything that a verb can write is its own from start to end, all or nothing. What another instance holds is refused,
//! or, where the logical devices that it belongs to declare it, waited for in the order of the starts, or taken by aborting the
//! holder. A start takes all that it needs at once, so nobody holds one thing while it waits for another: there is no deadlock.
use crate::core::Core;
use crate::instance::{Cause, Limits, State};
use crate::psi::stored_svvs;
use model::definition::Arbitration;
use model::plan::{Claim, Plan, Target};
use model::refusal::{Class, Refusal, Refusals};
use std::collections::BTreeSet;

/// A start that was accepted: its values are encoded.
pub(crate) struct Request {
    pub id: u64,
    pub stores: Vec<(Target, Vec<u8>)>,
    pub limits: Limits,
}

/// How a start gets what it needs.
pub(crate) enum Admission {
    Now,
    /// When these have ended.
    Later(Vec<String>),
}

/// Something that a start needs and another instance holds, or waits for.
pub(crate) struct Held {
    claim: Claim,
    pub holder: u64,
    arbitration: Arbitration,
}

impl Core {
    /// Whether a start may begin now, later, or not at all.
    pub fn arbitrate(&mut self, request: &Request) -> Result<Admission, Refusals> {
        let instance = &self.instances[&request.id];
        let (plan, name) = (instance.plan.clone(), instance.name.clone());
        let held = self.held(request, &plan, self.queue.len());
        if held.is_empty() {
            return Ok(Admission::Now);
        }
        let refused: Refusals = held.iter().filter(|h| h.arbitration == Arbitration::Refuse).map(|h| self.second_writer(&name, &plan, h)).collect();
        if !refused.is_empty() {
            return Err(refused);
        }
        let mut holders: Vec<u64> = held.iter().map(|h| h.holder).collect();
        holders.sort_unstable();
        holders.dedup();
        if held.iter().all(|h| h.arbitration == Arbitration::Abort) {
            // A later start takes their places, too.
            let waiting: Vec<u64> = holders.iter().filter(|h| self.instances[h].state == State::Queued).copied().collect();
            self.queue.retain(|r| !waiting.contains(&r.id));
            for id in waiting {
                self.ended_in_queue(id, "aborted", &format!("'{name}' was started"), false);
            }
            holders.retain(|h| self.claims.values().any(|holder| holder == h));
        }
        Ok(Admission::Later(holders.iter().map(|h| self.instances[h].name.clone()).collect()))
    }

    /// What a start needs and others hold, or (those before `place` in the queue) wait for.
    pub fn held(&self, request: &Request, plan: &Plan, place: usize) -> Vec<Held> {
        let mut held: Vec<Held> = Vec::new();
        let mut look = |claim: &Claim, arbitration: Arbitration| {
            let waits = |r: &&Request| needs(r, &self.instances[&r.id].plan).any(|(needed, _)| needed == *claim);
            let holders = self.claims.get(claim).copied().into_iter().chain(self.queue.iter().take(place).filter(waits).map(|r| r.id));
            held.extend(holders.filter(|h| *h != request.id).map(|holder| Held { claim: claim.clone(), holder, arbitration }));
        };
        needs(request, plan).for_each(|(claim, arbitration)| look(&claim, arbitration));
        held
    }

    pub fn second_writer(&self, name: &str, plan: &Plan, held: &Held) -> Refusal {
        let (holder, waits) = self.instances.get(&held.holder).map_or(("?", false), |i| (i.name.as_str(), i.state == State::Queued));
        let what = self.claim_name(&held.claim);
        let is = if waits { "waited for" } else { "written" };
        let message = if plan.claims.contains(&held.claim) {
            format!("cannot start '{name}': {what} is {is} by '{holder}'")
        } else {
            format!("'{}' cannot store into {what}: it is {is} by '{holder}'", plan.verb)
        };
        let refusal = Refusal::new(Class::SecondWriter, message).end(what, &None).end(format!("'{holder}'"), &None);
        refusal.remedy(format!("wait for '{holder}' or halt it"))
    }

    fn claim_name(&self, claim: &Claim) -> String {
        match claim {
            Claim::Svv { name, .. } => format!("SVV '{name}'"),
            Claim::Channel { device, channel } => {
                let name = self.physical.get(device).and_then(|p| p.device.channels().get(*channel).map(|c| c.name.clone()));
                format!("channel '{device}.{}'", name.unwrap_or_default())
            }
        }
    }

    /// A start waits for what it needs.
    pub fn enqueue(&mut self, request: Request) {
        if let Some(instance) = self.instances.get_mut(&request.id) {
            instance.state = State::Queued;
        }
        self.queue.push(request);
        self.serve_queue();
    }

    /// What it claimed is free again, and those who wait for it follow at once: nobody comes between.
    pub fn release_claims(&mut self, id: u64) {
        self.claims.retain(|_, holder| *holder != id);
        self.serve_queue();
    }

    /// Begins what may begin, in the order of the starts; aborts the holders where that is all that is left to wait for.
    fn serve_queue(&mut self) {
        let mut place = 0;
        while let Some(request) = self.queue.get(place) {
            let instance = &self.instances[&request.id];
            let (name, plan) = (instance.name.clone(), instance.plan.clone());
            let held = self.held(request, &plan, place);
            if held.is_empty() {
                let request = self.queue.remove(place);
                self.admit(request);
                continue;
            }
            let running = |h: &Held| self.instances[&h.holder].state != State::Queued;
            if held.iter().all(|h| h.arbitration == Arbitration::Abort && running(h)) {
                let holders: BTreeSet<u64> = held.iter().map(|h| h.holder).collect();
                let length = self.queue.len();
                holders.into_iter().for_each(|holder| self.abort(holder, &name, &plan));
                if self.queue.len() != length {
                    // A holder has ended at once, and the queue was served.
                    return;
                }
            }
            place += 1;
        }
    }

    /// A start whose turn has come begins, if what it stands on is still there.
    fn admit(&mut self, request: Request) {
        let instance = &self.instances[&request.id];
        let (id, name) = (instance.id, instance.name.clone());
        let refused = self
            .refuse_emergency("start", &name)
            .and_then(|()| self.check_mode(instance))
            .and_then(|()| self.check_enabled(instance))
            .and_then(|()| self.check_sources(instance))
            .and_then(|()| self.check_devices(instance));
        match refused {
            Ok(()) => {
                self.log.add(self.host.now_ns(), "admission", &name, "");
                self.begin(request);
            }
            Err(refusals) => {
                let message = refusals.first().map_or_else(String::new, |r| r.message.clone());
                let condition = if self.emergency.reason.is_some() { "emergency_stop" } else { "aborted" };
                self.ended_in_queue(id, condition, &message, false);
            }
        }
    }

    /// Those that wait in the queue first: what ends all of them then lets none begin.
    pub fn queued_first(&self, instances: &mut [u64]) {
        instances.sort_by_key(|id| self.instances.get(id).is_none_or(|i| i.state != State::Queued));
    }

    /// Ends an instance because a later start takes what it holds; once. Where that acts on all its devices it goes on with them at once;
    /// what would be left behind in its motion comes to rest first.
    fn abort(&mut self, id: u64, by: &str, plan: &Plan) {
        let message = format!("'{by}' was started");
        match self.instances.get_mut(&id) {
            Some(instance) if !instance.aborted => {
                instance.aborted = true;
                instance.is_overtaken = instance.plan.devices.iter().all(|device| plan.devices.contains(device));
            }
            _ => return,
        }
        self.end_by_name(id, "aborted", message);
    }

    /// The end of a start that has not begun.
    pub fn leave_queue(&mut self, id: u64, condition: &str, message: &str, asked_for: bool) {
        self.queue.retain(|request| request.id != id);
        self.ended_in_queue(id, condition, message, asked_for);
        self.serve_queue();
    }

    fn ended_in_queue(&mut self, id: u64, condition: &str, message: &str, asked_for: bool) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let Some(condition) = instance.condition(condition) else { return };
        instance.started_ns = now_ns;
        instance.ending = Some(Cause { condition, block: None, value: None, message: message.to_owned(), time_ns: now_ns, asked_for });
        self.ended(id);
    }
}

/// What a start needs: all that it may write, and the SVVs that ψ stores into.
fn needs<'a>(request: &'a Request, plan: &'a Plan) -> impl Iterator<Item = (Claim, Arbitration)> + 'a {
    let own = plan.claims.iter().cloned().zip(plan.arbitration.iter().copied());
    let stored = stored_svvs(plan, &request.stores).map(|(id, name, _)| Claim::Svv { id: *id, name: name.to_owned() });
    own.chain(stored.filter(|claim| !plan.claims.contains(claim)).map(|claim| (claim, Arbitration::Refuse)))
}
