// SPDX-License-Identifier: Apache-2.0
//! Creation and deletion of verb instances: creation converts a plan to memory and steps; deletion removes all of them.
use crate::alarms::causes::check_alarms;
use crate::claims::writers::Pair;
use crate::core::Core;
use crate::definitions::catalog::Catalog;
use crate::instances::course::Course;
use crate::instances::installed_verb::InstalledVerb;
use crate::instances::instance::{EndingEvents, Findings, Instance, Life, Position, Times, Work};
use crate::movements::sequence::Movement;
use crate::refuse::{invalid_state, refuse};
use crate::starting::psi::InputValues;
use crate::suspension::idle_values::check_hold;
use crate::transitions::stages::REMEMBERED_MAX;
use crate::wiring::connect::{crossings, enter_queues};
use crate::wiring::install::install;
use crate::wiring::installed::InstalledPlan;
use indexmap::IndexMap;
use kernel::SourceId;
use model::plan::Plan;
use model::refusal::{Class, Refusals};
use std::sync::Arc;

impl Core {
    /// Creates an instance of a plan. Its memory and steps exist on return; kernels receive the tables when its sequence proceeds.
    pub fn create(&mut self, catalog: &Catalog, plan: Arc<Plan>, name: Option<String>, owner: Option<String>) -> Result<u64, Refusals> {
        check_alarms(self, &plan)?;
        self.check_modules(&plan)?;
        check_hold(&self.registry, &self.instances, &plan)?;
        let id = self.numbers.fresh();
        let name = name.unwrap_or_else(|| self.instances.next_name(&plan.verb));
        let (installed, queues) = install(&mut self.registry, &self.host, &mut self.numbers, catalog, &plan, (id, &name))?;
        check_waits(&plan, &installed)?;
        let merged = self.carrier().merge_orders(&plan, &installed)?;
        let stages = InstalledVerb { plan: &plan, installed: &installed, devices: &self.registry.physical }.stages();
        installed.process.set_stages(stages);
        let mut sources = installed.sources.clone();
        sources.extend(enter_queues(&mut self.wiring, queues, id, &installed));
        self.carrier().make_stamps(&plan, &installed);
        self.carrier().enter_steps(id, &plan, &installed, merged);
        let crossings = crossings(&plan, &installed);
        let mut pairs: Vec<Pair> = crossings.iter().map(|(pair, _, _)| *pair).collect();
        pairs.extend(self.carrier().enter_svvs(id, &plan, &installed));
        self.wiring.crossings.insert(id, crossings);
        let followed = self.registry.followed(&plan);
        self.instances.insert(id, Instance { followed, ..instance(id, name, plan, installed, owner) });
        let (fills, appending) = self.carrier().enter_histories(id);
        sources.extend(appending);
        sources.extend(self.renew_taps());
        let connections = self.carrier().reconnect(pairs);
        let mut movements = if fills.is_empty() { vec![] } else { vec![Movement::Scripts(fills)] };
        movements.push(Movement::Tables(sources));
        movements.extend(connections);
        self.instances.get_mut(&id).expect("it was just entered").work.sequence.extend(movements);
        Ok(id)
    }

    /// Returns true for an instance on a single source of this process: its table may be sent in one script with its start. A remote
    /// processor must have the table of an instance before any message refers to the instance.
    pub fn waits_for_its_start(&self, id: u64) -> bool {
        let [source] = self.instances[&id].installed.sources[..] else { return false };
        self.remote.at(self.registry.source_name(source)).is_none()
    }

    /// Removes an instance from all registries.
    pub fn remove(&mut self, id: u64) {
        let sources = self.taken_out(id);
        self.carrier().renew_tables(sources);
    }

    /// Removes an instance; returns the sources whose tables change.
    fn taken_out(&mut self, id: u64) -> Vec<SourceId> {
        let mut sources = self.carrier().take_out(id);
        sources.extend(self.renew_taps());
        sources.sort();
        sources.dedup();
        sources
    }

    /// Refuses a plan that contains blocks of modules that were stopped by a fault.
    fn check_modules(&self, plan: &Plan) -> Result<(), Refusals> {
        for block in &plan.blocks {
            let module = block.block.split('.').next().unwrap_or("");
            if let Some(why) = self.safety.poisoned.get(module) {
                return Err(refuse(
                    Class::InvalidState,
                    format!("cannot install '{}': module '{module}' {why}", block.label),
                    "fix the block, download it again, and call reset()",
                ));
            }
        }
        Ok(())
    }
}

impl Course<'_> {
    /// Deletes an instance that is not running.
    pub fn delete(&mut self) -> Result<(), Refusals> {
        self.check_deletable()?;
        self.core.remove(self.id);
        Ok(())
    }

    /// Deletes the instance of a completed call. The tables are sent with the next call, which will probably follow soon.
    pub fn retire(&mut self) -> Result<(), Refusals> {
        self.check_deletable()?;
        let sources = self.core.taken_out(self.id);
        self.core.carrier().renew_tables_at_leisure(sources);
        Ok(())
    }

    fn check_deletable(&self) -> Result<(), Refusals> {
        let id = self.id;
        let instance = self.core.instances.known(id)?;
        if instance.is_busy() {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state().name(), "delete", "halt it or wait for it first"));
        }
        if let Some(owner) = &instance.owner {
            return Err(invalid_state(&format!("'{}'", instance.name), "the verb of a logical device", "delete", &format!("delete device '{owner}'")));
        }
        Ok(())
    }
}

/// Checks that the kernel has capacity for all conditions for which a stage waits.
fn check_waits(plan: &Plan, installed: &InstalledPlan) -> Result<(), Refusals> {
    let waited = InstalledVerb { plan, installed, devices: &IndexMap::new() }.waited_for().len();
    let count = plan.conditions.len() + waited;
    if waited == 0 || count <= REMEMBERED_MAX {
        return Ok(());
    }
    Err(refuse(
        Class::DefinitionError,
        format!("'{}' has {count} conditions and awaited conditions in total, more than {REMEMBERED_MAX}", plan.verb),
        "combine several block conditions into one termination condition, or split the verb",
    ))
}

fn instance(id: u64, name: String, plan: Arc<Plan>, installed: InstalledPlan, owner: Option<String>) -> Instance {
    let list = plan.initial;
    Instance {
        id,
        name,
        plan,
        installed,
        owner,
        origin: None,
        tuned: IndexMap::new(),
        inputs: InputValues::new(),
        changes: 0,
        followed: IndexMap::new(),
        life: Life::Created,
        starts: 0,
        generation: 0,
        position: Position { list, target: (list, 0), ..Position::default() },
        times: Times::default(),
        work: Work::default(),
        findings: Findings::default(),
        leaving: EndingEvents::default(),
    }
}
