// SPDX-License-Identifier: Apache-2.0
//! Insertion of a new instance into the running system: its steps into the order of each source, and its ports into the records of the
//! SVVs.
use crate::claims::writers::Pair;
use crate::movements::carrier::Carrier;
use crate::refuse::refuse;
use crate::registry::Registry;
use crate::svvs::cells::{SvvRecord, WriterRecord, make_stamps};
use crate::wiring::follow::step_drivers;
use crate::wiring::installed::InstalledPlan;
use crate::wiring::ports::mode_of;
use crate::wiring::tables::StepRecord;
use indexmap::IndexMap;
use kernel::{BlockId, SourceId, StampedValue};
use model::interface::Mode;
use model::order;
use model::plan::{CellKind, Plan, PlannedCell};
use model::refusal::{Class, Refusals};
use std::collections::{HashMap, HashSet};

/// Edge from writer to reader.
type Edge = (BlockId, BlockId);

impl Carrier<'_> {
    /// Returns the firing order of each source with the new blocks inserted.
    pub fn merge_orders(&self, plan: &Plan, installed: &InstalledPlan) -> Result<Vec<(SourceId, Vec<BlockId>)>, Refusals> {
        let mut merged = Vec::new();
        for (source_name, planned) in &plan.order {
            let source = self.registry.sources[source_name];
            let existing: Vec<BlockId> = self.wiring.tables[&source].steps.iter().map(|s| s.id).collect();
            let new: Vec<BlockId> = planned.iter().map(|b| installed.blocks[*b].id()).collect();
            if existing.is_empty() {
                merged.push((source, new));
                continue;
            }
            let (hard, soft) = self.edges(plan, installed, source);
            let order = order::insert(&existing, &new, &hard, &soft).map_err(|cycle| self.cycle(&plan.verb, installed, source_name, &cycle))?;
            merged.push((source, order));
        }
        Ok(merged)
    }

    /// Returns the refusal of a cycle of synchronous ports, each of which would have to run before the next.
    fn cycle(&self, verb: &str, installed: &InstalledPlan, source: &str, cycle: &[BlockId]) -> Refusals {
        let known = self.wiring.tables.values().flat_map(|t| &t.steps).map(|s| &s.block).chain(&installed.blocks);
        let names: Vec<&str> = known.filter(|b| cycle.contains(&b.id())).map(|b| b.name()).collect();
        refuse(
            Class::SynchronousCycle,
            format!("'{verb}' cannot be inserted into the firing order of source '{source}': synchronous ports form a cycle through {}", names.join(", ")),
            "make one of them asynchronous with modes=",
        )
    }

    /// Returns the edges that the new blocks add to the order of a source, synchronous and asynchronous: those of their own plan that its
    /// order satisfies, and those through SVVs to installed blocks. The writer of an SVV runs only while it has claimed the SVV, so there
    /// is no edge between two instances that both write it: they never run at the same time.
    fn edges(&self, plan: &Plan, installed: &InstalledPlan, source: SourceId) -> (Vec<Edge>, Vec<Edge>) {
        let (mut hard, mut soft) = own_edges(plan, installed, source);
        for cell in &plan.cells {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            if cell.writers.is_empty() {
                let writers = self.registry.svvs[name].writers.iter().filter(|w| w.source == source);
                for (writer, (reader, item)) in writers.flat_map(|w| cell.readers.iter().map(move |r| (w, r))) {
                    if installed.block_source[*reader] == source {
                        let edge = (writer.block, installed.blocks[*reader].id());
                        match mode_of(plan, *reader, *item) {
                            Mode::Asynchronous => soft.push(edge),
                            _ => hard.push(edge),
                        }
                    }
                }
            }
            for (writer, _) in cell.writers.iter().filter(|(b, _)| installed.block_source[*b] == source) {
                let writer = installed.blocks[*writer].id();
                for (reader, follows) in self.readers_of(name, source) {
                    if follows { hard.push((writer, reader)) } else { soft.push((writer, reader)) }
                }
            }
        }
        (hard, soft)
    }

    /// Returns the installed blocks of a source that read an SVV written by others, each with a flag that is true if it reads
    /// synchronously.
    fn readers_of(&self, svv: &str, source: SourceId) -> Vec<(BlockId, bool)> {
        let mut found = Vec::new();
        for instance in self.instances.values().filter(|i| i.installed.sources.contains(&source)) {
            let is_it = |c: &&PlannedCell| c.writers.is_empty() && matches!(&c.kind, CellKind::Svv { name, .. } if name == svv);
            for cell in instance.plan.cells.iter().filter(is_it) {
                let here = cell.readers.iter().filter(|(block, _)| instance.installed.block_source[*block] == source);
                found.extend(here.map(|(block, item)| (instance.installed.blocks[*block].id(), mode_of(&instance.plan, *block, *item) == Mode::Synchronous)));
            }
        }
        found
    }

    /// Adds the steps of an instance to the tables of its sources.
    pub fn enter_steps(&mut self, id: u64, plan: &Plan, installed: &InstalledPlan, merged: Vec<(SourceId, Vec<BlockId>)>) {
        for (source, order) in merged {
            let table = self.wiring.tables.get_mut(&source).expect("a source has its table as long as the system lives");
            let mut steps: HashMap<BlockId, StepRecord> = table.steps.drain(..).map(|s| (s.id, s)).collect();
            for index in (0..plan.blocks.len()).filter(|b| installed.block_source[*b] == source) {
                let block = installed.blocks[index].clone();
                steps.insert(block.id(), step(id, plan, installed, index, self.registry));
            }
            table.steps = order.iter().filter_map(|id| steps.remove(id)).collect();
        }
    }

    /// Creates the stamps of SVVs in the images of their possible writers.
    pub fn make_stamps(&mut self, plan: &Plan, installed: &InstalledPlan) {
        for &source in &installed.sources {
            let writes = |cell: &&PlannedCell| cell.writers.iter().any(|(block, _)| installed.block_source[*block] == source);
            let svv = |cell: &PlannedCell| if let CellKind::Svv { name, .. } = &cell.kind { Some(name.clone()) } else { None };
            let names: HashSet<String> = plan.cells.iter().filter(writes).filter_map(svv).collect();
            make_stamps(self.registry.svvs.iter_mut().filter(|(name, _)| names.contains(*name)).map(|(_, svv)| svv), source);
        }
    }

    /// Registers the readers and possible writers of the SVVs. Returns the pairs whose connections change.
    pub fn enter_svvs(&mut self, id: u64, plan: &Plan, installed: &InstalledPlan) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for (index, cell) in plan.cells.iter().enumerate() {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let svv = self.registry.svvs.get_mut(name).expect("the plan was made from the SVVs that exist");
            svv.bound += 1;
            for (block, _) in &cell.readers {
                let source = installed.block_source[*block];
                let count = svv.readers.entry(source).or_default();
                *count += 1;
                if let Some(home) = svv.home.filter(|home| *count == 1 && *home != source) {
                    pairs.push((home, source));
                }
            }
            pairs.extend(svv.count_windows(plan, index, &installed.block_source));
            for (block, item) in &cell.writers {
                let activation = plan.blocks[*block].activation;
                svv.writers.push(WriterRecord {
                    instance: id,
                    source: installed.block_source[*block],
                    activation: installed.activations[activation].clone(),
                    block: installed.blocks[*block].id(),
                    ratio: if let Mode::Ratio(n) = mode_of(plan, *block, *item) { n } else { 1 },
                });
            }
        }
        pairs
    }
}

/// Returns the edges within a plan, except those that its own order violates.
fn own_edges(plan: &Plan, installed: &InstalledPlan, source: SourceId) -> (Vec<Edge>, Vec<Edge>) {
    let mut position = vec![None; plan.blocks.len()];
    let planned = plan.order.iter().flat_map(|(_, blocks)| blocks).filter(|block| installed.block_source[**block] == source);
    for (at, block) in planned.enumerate() {
        position[*block] = Some(at);
    }
    let (mut hard, mut soft) = (Vec::new(), Vec::new());
    for (cell, (reader, item)) in plan.cells.iter().flat_map(|cell| cell.readers.iter().map(move |reader| (cell, reader))) {
        for (writer, _) in &cell.writers {
            // `None` means another source, which precedes everything.
            if position[*writer].is_none() || position[*writer] >= position[*reader] {
                continue;
            }
            let edge = (installed.blocks[*writer].id(), installed.blocks[*reader].id());
            match mode_of(plan, *reader, *item) {
                Mode::Synchronous => hard.push(edge),
                Mode::Asynchronous => soft.push(edge),
                Mode::Ratio(_) => {}
            }
        }
    }
    (hard, soft)
}

/// Returns the SVVs that a block stores, and the private cells that other blocks also store, with their stamps in the block's image.
fn stamped(plan: &Plan, installed: &InstalledPlan, block: usize, svvs: &IndexMap<String, SvvRecord>) -> Vec<StampedValue> {
    let source = installed.block_source[block];
    let mut found = Vec::new();
    for (index, cell) in plan.cells.iter().enumerate() {
        for (_, item) in cell.writers.iter().filter(|(writer, _)| *writer == block) {
            let svv = if let CellKind::Svv { name, .. } = &cell.kind { svvs.get(name) } else { None };
            let stamps = svv.map(|svv| &svv.stamps).or_else(|| installed.own_stamps.get(&index));
            let Some(stamp) = stamps.and_then(|stamps| stamps.get(&source)).cloned() else { continue };
            let history = svv.and_then(|svv| svv.cells.get(&source).cloned().zip(svv.past.rings.get(&source).cloned()));
            let ratio = if let Mode::Ratio(n) = mode_of(plan, block, *item) { n } else { 1 };
            found.push(StampedValue { block: installed.blocks[block].clone(), ratio, stamp, history });
        }
    }
    found
}

/// Returns the step of a planned block.
fn step(instance: u64, plan: &Plan, installed: &InstalledPlan, index: usize, registry: &Registry) -> StepRecord {
    let planned = &plan.blocks[index];
    let block = installed.blocks[index].clone();
    StepRecord {
        instance,
        id: block.id(),
        block,
        before: installed.before[index].clone(),
        after: installed.after[index].clone(),
        appends: Vec::new(),
        stamped: stamped(plan, installed, index, &registry.svvs),
        activation: installed.activations[planned.activation].clone(),
        process: installed.process.clone(),
        drivers: step_drivers(plan, installed, index, registry),
    }
}
