// SPDX-License-Identifier: Apache-2.0
//! Needs of a start that other instances hold or wait for.
use crate::instances::instance::State;
use crate::instances::table::{Instances, Request};
use crate::registry::Registry;
use crate::starting::psi::stored_svvs;
use model::definition::Arbitration;
use model::plan::{Claim, Plan};
use model::refusal::{Class, Refusal};

/// A claim that a start needs and that another instance holds or waits for.
pub(crate) struct HeldClaim {
    pub claim: Claim,
    pub holder: u64,
    pub arbitration: Arbitration,
}

impl Instances {
    /// Returns the claims that a start needs but cannot take, because another instance holds them or a start before `place` in the queue
    /// is waiting for them.
    pub fn held(&self, registry: &Registry, request: &Request, plan: &Plan, place: usize) -> Vec<HeldClaim> {
        let mut held: Vec<HeldClaim> = Vec::new();
        let mut look = |claim: &Claim, arbitration: Arbitration| {
            let waits = |r: &&Request| needs(r, &self[&r.id].plan).any(|(needed, _)| needed == *claim);
            let holders = registry.claims.get(claim).copied().into_iter().chain(self.queue.iter().take(place).filter(waits).map(|r| r.id));
            held.extend(holders.filter(|h| *h != request.id).map(|holder| HeldClaim { claim: claim.clone(), holder, arbitration }));
        };
        needs(request, plan).for_each(|(claim, arbitration)| look(&claim, arbitration));
        held
    }

    pub fn second_writer(&self, registry: &Registry, name: &str, plan: &Plan, held: &HeldClaim) -> Refusal {
        let (holder, waits) = self.get(&held.holder).map_or(("?", false), |i| (i.name.as_str(), i.state() == State::Queued));
        let what = registry.claim_name(&held.claim);
        let is = if waits { "waited for" } else { "written" };
        let message = if plan.claims.contains(&held.claim) {
            format!("cannot start '{name}': {what} is {is} by '{holder}'")
        } else {
            format!("'{}' cannot store into {what}: it is {is} by '{holder}'", plan.verb)
        };
        let refusal = Refusal::new(Class::SecondWriter, message).end(what, &None).end(format!("'{holder}'"), &None);
        refusal.remedy(format!("wait for '{holder}' or halt it"))
    }

    /// Sorts queued instances to the front. They are ended first, so that none of them starts when another one releases its claims.
    pub fn queued_first(&self, instances: &mut [u64]) {
        instances.sort_by_key(|id| self.get(id).is_none_or(|i| i.state() != State::Queued));
    }
}

/// Returns the needs of a start: everything that it may write, and the SVVs in which ψ stores values.
fn needs<'a>(request: &'a Request, plan: &'a Plan) -> impl Iterator<Item = (Claim, Arbitration)> + 'a {
    let own = plan.claims.iter().cloned().zip(plan.arbitration.iter().copied());
    let stored = stored_svvs(plan, &request.stores).map(|(id, name, _)| Claim::Svv { id: *id, name: name.to_owned() });
    own.chain(stored.filter(|claim| !plan.claims.contains(claim)).map(|claim| (claim, Arbitration::Refuse)))
}
