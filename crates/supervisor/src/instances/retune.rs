// SPDX-License-Identifier: Apache-2.0
//! Tunable intervals. They may be changed while a verb is running; a change takes effect at a period boundary, after the model has
//! checked that all rates still hold: those within the instance, those of its inputs, and those of every instance that reads its outputs.
use crate::definitions::system_definitions::Definitions;
use crate::instances::instance::{Instance, Intervals, Origin};
use crate::refuse::invalid_state;
use crate::system::System;
use indexmap::IndexMap;
use model::configuration::Writer;
use model::plan::Plan;
use model::refusal::{Refusal, Refusals};
use model::value::Value;
use std::sync::Arc;

/// An instance whose rates are being checked.
#[derive(Clone)]
struct Party {
    id: u64,
    name: String,
    origin: Origin,
    tuned: Intervals,
    plan: Arc<Plan>,
}

impl Party {
    fn of(instance: &Instance) -> Option<Party> {
        let origin = instance.origin.clone()?;
        Some(Party { id: instance.id, name: instance.name.clone(), origin, tuned: instance.tuned.clone(), plan: instance.plan.clone() })
    }

    fn retuned(&self, definitions: &Definitions) -> Result<Plan, Refusals> {
        self.origin.checked.retuned(&self.origin.application, &self.tuned, &self.plan, &definitions.configuration)
    }

    /// Returns true if one of these SVVs drives a synchronous or ratio input of the instance.
    fn follows(&self, svvs: &[String]) -> bool {
        self.plan.blocks.iter().flat_map(|block| &block.external_drivers).any(|(_, svv)| svvs.contains(svv))
    }
}

impl System {
    /// Sets new values of tunable input parameters of a running instance, and new intervals (label → ns), all together between two
    /// firings of each source.
    ///
    /// # Errors
    /// Fails if an item is not tunable, if a value does not match its type, or if a rate would no longer hold; the refusal then names both ends of the relation. In that case nothing has changed.
    pub fn set(&self, instance: u64, values: &IndexMap<String, Value>, every: &IndexMap<String, u64>) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let present = self.shared.locked().instances.known(instance)?.plan.clone();
        let values = &self.settled_set(&present, values, &definitions.configuration)?;
        if every.is_empty() {
            return self.shared.command(|core| core.course(instance).set(values, None));
        }
        let before = definitions.configuration.writers.clone();
        let (tuned, plan) = self.rates_with(&mut definitions, instance, every)?;
        let done = self.shared.command(|core| core.course(instance).set(values, Some((tuned, &plan))));
        if done.is_err() {
            definitions.configuration.writers = before;
        }
        done
    }

    /// Restores the declared intervals if an earlier start has changed them and if all rates hold with them.
    pub(crate) fn untune(&self, definitions: &mut Definitions, instance: u64) -> Result<(), Refusals> {
        let party = self.shared.locked().instances.get(&instance).filter(|i| !i.tuned.is_empty() && !i.is_busy()).and_then(Party::of);
        let Some(party) = party else { return Ok(()) };
        self.rates_hold(definitions, Party { tuned: Intervals::new(), ..party })?;
        self.shared.locked().instances.get_mut(&instance).expect("found above").tuned.clear();
        Ok(())
    }

    /// Returns all resulting intervals, and the plan that uses them.
    fn rates_with(&self, definitions: &mut Definitions, instance: u64, every: &IndexMap<String, u64>) -> Result<(Intervals, Plan), Refusals> {
        let mut party = {
            let core = self.shared.locked();
            let instance = core.instances.known(instance)?;
            instance.check_settable()?;
            Party::of(instance)
                .ok_or_else(|| invalid_state(&format!("'{}'", instance.name), "not an application of a verb", "set an interval of", "apply its verb"))?
        };
        party.tuned.extend(every.iter().map(|(label, every_ns)| (label.clone(), *every_ns)));
        let tuned = party.tuned.clone();
        let about = format!("cannot change the intervals of '{}'", party.name);
        let named = |refusals: Refusals| refusals.into_iter().map(|refusal: Refusal| refusal.for_what(&about)).collect::<Refusals>();
        Ok((tuned, self.rates_hold(definitions, party).map_err(named)?))
    }

    /// Checks that the rates of instances that follow SVVs still hold when a new instance writes these SVVs.
    pub(crate) fn followers_hold(&self, definitions: &mut Definitions, instance: u64) -> Result<(), Refusals> {
        let (name, written) = {
            let core = self.shared.locked();
            let instance = core.instances.known(instance)?;
            let mut written = core.registry.shared_svvs(&instance.plan);
            written.retain(|svv| core.instances.values().any(|other| other.followed.contains_key(svv)));
            (instance.name.clone(), written)
        };
        if written.is_empty() {
            return Ok(());
        }
        let before = definitions.configuration.writers.clone();
        let about = format!("'{name}' would drive others");
        let held = self.follow_rates(definitions, instance, written);
        held.map_err(|refusals| {
            definitions.configuration.writers = before;
            refusals.into_iter().map(|refusal| refusal.for_what(&about)).collect()
        })
    }

    /// Checks the rates of an instance and of all its followers; if they hold, makes them visible to later applications.
    fn rates_hold(&self, definitions: &mut Definitions, party: Party) -> Result<Plan, Refusals> {
        let before = definitions.configuration.writers.clone();
        let plan = party.retuned(definitions)?;
        let changed = enter_rates(definitions, &party.name, &plan);
        self.follow_rates(definitions, party.id, changed).inspect_err(|_| definitions.configuration.writers = before)?;
        Ok(plan)
    }

    /// Checks the rates of all followers of these SVVs, and of their followers in turn.
    fn follow_rates(&self, definitions: &mut Definitions, instance: u64, mut changed: Vec<String>) -> Result<(), Refusals> {
        let others: Vec<Party> = self.shared.locked().instances.values().filter(|i| i.id != instance && !i.followed.is_empty()).filter_map(Party::of).collect();
        let mut seen = vec![instance];
        while !changed.is_empty() {
            let mut next = Vec::new();
            for other in &others {
                if other.follows(&changed) && !seen.contains(&other.id) {
                    seen.push(other.id);
                    let about = format!("'{}' follows it", other.name);
                    let plan = other.retuned(definitions).map_err(|refusals| refusals.into_iter().map(|r| r.for_what(&about)).collect::<Refusals>())?;
                    next.extend(enter_rates(definitions, &other.name, &plan));
                }
            }
            changed = next;
        }
        Ok(())
    }
}

/// Registers the rates at which an instance writes. Returns the SVVs whose writer has changed.
fn enter_rates(definitions: &mut Definitions, instance: &str, plan: &Plan) -> Vec<String> {
    let mut changed = Vec::new();
    for (svv, writer) in plan.writers(instance, &definitions.configuration) {
        let is_same = |known: &&mut Writer| known.instance == writer.instance && known.port == writer.port;
        if let Some(known) = definitions.configuration.writers.get_mut(&svv).and_then(|writers| writers.iter_mut().find(is_same))
            && *known != writer
        {
            *known = writer;
            changed.push(svv);
        }
    }
    changed
}
