// SPDX-License-Identifier: Apache-2.0
//! What drives an activation across instances: whoever writes the SVV that it takes synchronously or by ratio, at the time. When another
//! instance starts to write it, its followers turn to that one; so a reader outlives its writers.
use crate::connect::{Delays, enter_queues, mode_of, open, queues};
use crate::core::Core;
use crate::install::Installed;
use crate::instance::Instance;
use crate::sequence::Movement;
use crate::svvs::{SvvRecord, WriterRecord};
use indexmap::IndexMap;
use kernel::{Activation, BlockId, Due, Inbound, Op, SourceId};
use model::interface::Mode;
use model::plan::{self, CellKind, Claim, Plan};
use std::collections::HashMap;
use std::sync::Arc;

/// A member of a queue that an activation of the plan waits for.
pub(crate) struct Gate {
    /// The SVV of another instance, where it is one.
    pub svv: Option<String>,
    pub activation: usize,
    pub inbound: Arc<Inbound>,
    pub member: usize,
}

/// What says who writes an SVV now.
pub(crate) type Drivers<'a> = (&'a IndexMap<String, SvvRecord>, &'a HashMap<Claim, u64>);

/// Who writes an SVV now: of the instance that has claimed it the block that is on, else the first that could.
fn driver_of<'a>((svvs, claims): Drivers<'a>, svv: &str) -> Option<&'a WriterRecord> {
    let record = svvs.get(svv)?;
    let holder = claims.get(&Claim::Svv { id: record.id, name: svv.to_owned() });
    let held = || record.writers.iter().filter(|writer| Some(&writer.instance) == holder);
    held().find(|writer| Some(writer.block) == record.written_by).or_else(|| held().next()).or_else(|| record.writers.first())
}

/// The SVVs of others that a block takes synchronously.
fn driving_svvs(plan: &Plan, block: usize) -> impl Iterator<Item = &str> {
    let external = plan.blocks[block].external_drivers.iter();
    external.filter(move |(item, _)| mode_of(plan, block, *item) == Mode::Synchronous).map(|(_, svv)| svv.as_str())
}

/// Blocks of the same source that drive a block: of its plan, and of other instances.
pub(crate) fn step_drivers(plan: &Plan, installed: &Installed, block: usize, drivers: Drivers) -> Vec<BlockId> {
    let source = installed.block_source[block];
    let inner = plan.blocks[block].drivers.iter().map(|driver| installed.blocks[*driver].id());
    let gated = |svv: &&str| installed.gates.iter().any(|gate| gate.activation == plan.blocks[block].activation && gate.svv.as_deref() == Some(*svv));
    let outer = driving_svvs(plan, block)
        .filter(|svv| !gated(svv))
        .filter_map(|svv| driver_of(drivers, svv))
        .filter(|writer| writer.source == source)
        .map(|writer| writer.block);
    inner.chain(outer).collect()
}

/// When an activation of a plan is due, as the system is now. Those that drive it in the plan are made.
pub(crate) fn due(core: &Core, plan: &Plan, activations: &[Arc<Activation>], gates: &[Gate], (index, source): (usize, SourceId)) -> Due {
    let own = |by: &[(usize, u32)]| -> Vec<(Arc<Activation>, u32)> { by.iter().map(|(driver, n)| (activations[*driver].clone(), *n)).collect() };
    match &plan.activations[index].due {
        plan::Due::Interval => Due::Interval,
        plan::Due::Driven { by } => Due::Driven { by: own(by) },
        plan::Due::Queued { by } => {
            let mut by = own(by);
            by.extend(outside(core, plan, gates, (index, source)));
            let members: Vec<(Arc<Inbound>, usize)> =
                gates.iter().filter(|gate| gate.activation == index).map(|gate| (gate.inbound.clone(), gate.member)).collect();
            if members.is_empty() { Due::Driven { by } } else { Due::Queued { members, by } }
        }
    }
}

/// Activations of other instances in the same source that drive this one; of an SVV that nobody writes, one that is never on.
fn outside(core: &Core, plan: &Plan, gates: &[Gate], (activation, source): (usize, SourceId)) -> Vec<(Arc<Activation>, u32)> {
    let mut found: Vec<(Arc<Activation>, u32)> = Vec::new();
    for svv in plan.activations[activation].blocks.iter().flat_map(|block| driving_svvs(plan, *block)) {
        if gates.iter().any(|gate| gate.activation == activation && gate.svv.as_deref() == Some(svv)) {
            // Its values come through a queue.
            continue;
        }
        match core.driver_of(svv) {
            Some(writer) if writer.source == source => {
                if !found.iter().any(|(known, n)| Arc::ptr_eq(known, &writer.activation) && *n == writer.ratio) {
                    found.push((writer.activation.clone(), writer.ratio));
                }
            }
            Some(_) => {}
            None => found.push((Activation::new(Due::Interval, None), 1)),
        }
    }
    found
}

impl Core {
    /// Who writes an SVV now.
    pub fn driver_of(&self, svv: &str) -> Option<&WriterRecord> {
        driver_of((&self.svvs, &self.claims), svv)
    }

    /// An instance begins to write what it has claimed: those that follow these SVVs turn to it.
    pub fn turn_followers(&mut self, writer: u64) -> Vec<Movement> {
        let mut movements = Vec::new();
        for svv in self.shared_svvs(&self.instances[&writer].plan) {
            let turned = |instance: &&Instance| instance.followed.get(&svv).is_some_and(|followed| *followed != writer);
            let followers: Vec<u64> = self.instances.values().filter(turned).map(|instance| instance.id).collect();
            for follower in followers {
                movements.extend(self.turn(follower, &svv, writer));
            }
        }
        movements
    }

    /// All that follow an SVV of this instance turn to the block that writes it now.
    pub fn turn_all(&mut self, svv: &str, writer: u64) -> Vec<Movement> {
        let followers: Vec<u64> = self.instances.values().filter(|instance| instance.followed.contains_key(svv)).map(|instance| instance.id).collect();
        followers.into_iter().filter_map(|follower| self.turn(follower, svv, writer)).collect()
    }

    /// SVVs that a plan writes and that another instance is bound to.
    pub fn shared_svvs(&self, plan: &Plan) -> Vec<String> {
        let written = plan.cells.iter().filter(|cell| !cell.writers.is_empty());
        let svvs = written.filter_map(|cell| if let CellKind::Svv { name, .. } = &cell.kind { Some(name) } else { None });
        svvs.filter(|svv| self.svvs.get(*svv).is_some_and(|record| record.bound > 1)).cloned().collect()
    }

    /// Whom a new instance follows.
    pub fn followed(&self, plan: &Plan) -> IndexMap<String, u64> {
        let svvs = plan.blocks.iter().flat_map(|block| &block.external_drivers).map(|(_, svv)| svv);
        svvs.filter_map(|svv| Some((svv.clone(), self.driver_of(svv)?.instance))).collect()
    }

    /// Turns one follower of an SVV to another writer: a queue of its own, or the writer's activation where both are in one source.
    pub fn turn(&mut self, follower: u64, svv: &str, writer: u64) -> Option<Movement> {
        let mut instance = self.instances.remove(&follower)?;
        instance.followed.insert(svv.to_owned(), writer);
        let mut sources = Vec::new();
        for (source, table) in &mut self.tables {
            let before = (table.outlets.len(), table.inlets.len());
            table.outlets.retain(|outlet| !(outlet.instance == Some(follower) && outlet.svv.as_deref() == Some(svv)));
            table.inlets.retain(|inlet| !(inlet.instance == Some(follower) && inlet.svv.as_deref() == Some(svv)));
            if before != (table.outlets.len(), table.inlets.len()) {
                sources.push(*source);
            }
        }
        let (plan, installed) = (instance.plan.clone(), &mut instance.installed);
        let delays: Delays = installed.delays.iter().map(|(_, block, item, cell)| ((*block, *item), cell.clone())).collect();
        let made = open(queues(self, &plan, &installed.block_source, &installed.cells, &delays, Some(svv)));
        installed.gates.retain(|gate| gate.svv.as_deref() != Some(svv));
        installed.gates.extend(made.iter().flat_map(crate::connect::HalfQueue::gates));
        sources.extend(enter_queues(self, made, follower, installed));
        let mut follows = Vec::new();
        for (index, activation) in plan.activations.iter().enumerate() {
            if activation.blocks.iter().any(|block| driving_svvs(&plan, *block).any(|driving| driving == svv)) {
                let source = installed.activation_source[index];
                let due = due(self, &plan, &installed.activations, &installed.gates, (index, source));
                follows.push((source, installed.activations[index].follow(due)));
                sources.push(source);
            }
        }
        for (index, source) in installed.block_source.iter().enumerate() {
            let drivers = step_drivers(&plan, installed, index, (&self.svvs, &self.claims));
            let id = installed.blocks[index].id();
            if let Some(step) = self.tables.get_mut(source).and_then(|table| table.steps.iter_mut().find(|step| step.id == id)) {
                step.drivers = drivers;
            }
        }
        self.instances.insert(follower, instance);
        Some(Movement::Follow { sources, follows })
    }

    /// New tables for these sources, each with what lets its activations follow.
    pub fn follow_ops(&self, mut sources: Vec<SourceId>, follows: Vec<(SourceId, Op)>) -> Vec<(SourceId, Vec<Op>)> {
        sources.sort();
        sources.dedup();
        let mut scripts: Vec<(SourceId, Vec<Op>)> = sources.into_iter().map(|source| (source, vec![self.table_op(source)])).collect();
        for (source, op) in follows {
            if let Some((_, ops)) = scripts.iter_mut().find(|(of, _)| *of == source) {
                // Before the table: its scratch is in the order that the new drivers ask for.
                ops.insert(0, op);
            }
        }
        scripts
    }
}
