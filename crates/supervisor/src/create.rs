// SPDX-License-Identifier: Apache-2.0
//! Making and deleting verb instances: a plan becomes memory and steps; deleting leaves nothing of them.
use crate::catalog::Catalog;
use crate::connect::{Pair, crossings, enter_queues, mode_of};
use crate::core::Core;
use crate::follow::{Drivers, step_drivers};
use crate::install::{Installed, install};
use crate::instance::{Instance, Limits, RunningTime, State};
use crate::refuse::{invalid_state, refuse};
use crate::sequence::Movement;
use crate::stages::{REMEMBERED_MAX, Verbatim};
use crate::svvs::{SvvRecord, WriterRecord, make_stamps};
use crate::tables::StepRecord;
use indexmap::IndexMap;
use kernel::{BlockId, SourceId, Stamped};
use model::interface::Mode;
use model::order;
use model::plan::{CellKind, Plan, PlannedCell};
use model::refusal::{Class, Refusals};
use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::Arc;

/// (writer, reader).
type Edge = (BlockId, BlockId);

impl Core {
    /// Makes an instance of a plan. Its memory and steps are there when this returns; kernels take the tables as soon as they can.
    pub fn create(&mut self, catalog: &Catalog, plan: Arc<Plan>, name: Option<String>, owner: Option<String>) -> Result<u64, Refusals> {
        self.check_alarms(&plan)?;
        let id = self.fresh();
        let name = name.unwrap_or_else(|| self.next_name(&plan.verb));
        let (installed, queues) = install(self, catalog, &plan, id, &name)?;
        check_waits(&plan, &installed)?;
        let merged = self.merge_orders(&plan, &installed)?;
        let stages = Verbatim { plan: &plan, installed: &installed, devices: &self.physical }.stages();
        installed.process.set_stages(stages);
        let mut sources = installed.sources.clone();
        sources.extend(enter_queues(self, queues, id, &installed));
        self.make_stamps(&plan, &installed);
        self.enter_steps(id, &plan, &installed, merged);
        let crossings = crossings(&plan, &installed);
        let mut pairs: Vec<Pair> = crossings.iter().map(|(pair, _, _)| *pair).collect();
        pairs.extend(self.enter_svvs(id, &plan, &installed));
        let followed = self.followed(&plan);
        self.instances.insert(id, Instance { followed, ..instance(id, name, plan, installed, crossings, owner) });
        let (fills, appending) = self.enter_histories(id);
        sources.extend(appending);
        sources.extend(self.renew_taps());
        let connections = self.reconnect(pairs);
        let mut movements = if fills.is_empty() { vec![] } else { vec![Movement::Scripts(fills)] };
        movements.push(Movement::Tables(sources));
        movements.extend(connections);
        self.append_sequence(id, movements);
        Ok(id)
    }

    /// A name for the next instance of a verb: `move#1`, `move#2`, …
    fn next_name(&mut self, verb: &str) -> String {
        let count = self.named.entry(verb.to_owned()).or_default();
        loop {
            *count += 1;
            let name = format!("{verb}#{count}");
            if !self.instances.values().any(|i| i.name == name) {
                return name;
            }
        }
    }

    /// The order of a firing in each source with the new blocks in it.
    fn merge_orders(&self, plan: &Plan, installed: &Installed) -> Result<Vec<(SourceId, Vec<BlockId>)>, Refusals> {
        let mut merged = Vec::new();
        for (source_name, planned) in &plan.order {
            let source = self.sources[source_name];
            let existing: Vec<BlockId> = self.tables[&source].steps.iter().map(|s| s.id).collect();
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

    /// Synchronous ports that would have to run both before and after each other.
    fn cycle(&self, verb: &str, installed: &Installed, source: &str, cycle: &[BlockId]) -> Refusals {
        let known = self.tables.values().flat_map(|t| &t.steps).map(|s| &s.block).chain(&installed.blocks);
        let names: Vec<&str> = known.filter(|b| cycle.contains(&b.id())).map(|b| b.name()).collect();
        refuse(
            Class::SynchronousCycle,
            format!("'{verb}' cannot be put into the order of source '{source}': synchronous ports make a cycle through {}", names.join(", ")),
            "make one of them asynchronous with modes=",
        )
    }

    /// Edges that the new blocks bring into the order of a source, synchronous and asynchronous: those of their own plan as far as its
    /// order holds them, and those through SVVs with what is there. Whoever writes an SVV runs only while it has claimed it: between two
    /// instances that both write it there is no edge, for they never run at one time.
    fn edges(&self, plan: &Plan, installed: &Installed, source: SourceId) -> (Vec<Edge>, Vec<Edge>) {
        let (mut hard, mut soft) = own_edges(plan, installed, source);
        for cell in &plan.cells {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            if cell.writers.is_empty() {
                let writers = self.svvs[name].writers.iter().filter(|w| w.source == source);
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

    /// Installed blocks of a source that read an SVV that others write, and whether synchronously.
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

    /// Enters the steps of an instance in the tables of its sources.
    fn enter_steps(&mut self, id: u64, plan: &Plan, installed: &Installed, merged: Vec<(SourceId, Vec<BlockId>)>) {
        for (source, order) in merged {
            let table = self.tables.get_mut(&source).expect("a source has its table as long as the system lives");
            let mut steps: HashMap<BlockId, StepRecord> = table.steps.drain(..).map(|s| (s.id, s)).collect();
            for index in (0..plan.blocks.len()).filter(|b| installed.block_source[*b] == source) {
                let block = installed.blocks[index].clone();
                steps.insert(block.id(), step(id, plan, installed, index, (&self.svvs, &self.claims)));
            }
            table.steps = order.iter().filter_map(|id| steps.remove(id)).collect();
        }
    }

    /// What SVVs have in the images of those that may write them.
    fn make_stamps(&mut self, plan: &Plan, installed: &Installed) {
        for &source in &installed.sources {
            let writes = |cell: &&PlannedCell| cell.writers.iter().any(|(block, _)| installed.block_source[*block] == source);
            let svv = |cell: &PlannedCell| if let CellKind::Svv { name, .. } = &cell.kind { Some(name.clone()) } else { None };
            let names: HashSet<String> = plan.cells.iter().filter(writes).filter_map(svv).collect();
            make_stamps(self.svvs.iter_mut().filter(|(name, _)| names.contains(*name)).map(|(_, svv)| svv), source);
        }
    }

    /// Tells the SVVs who reads and may write them. The pairs whose connections change.
    fn enter_svvs(&mut self, id: u64, plan: &Plan, installed: &Installed) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for (index, cell) in plan.cells.iter().enumerate() {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let svv = self.svvs.get_mut(name).expect("the plan was made from the SVVs that exist");
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

    /// Deletes an instance that is not running.
    pub fn delete(&mut self, id: u64) -> Result<(), Refusals> {
        let instance = self.instance(id)?;
        if instance.is_busy() {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state.name(), "delete", "halt it or wait for it first"));
        }
        if let Some(owner) = &instance.owner {
            return Err(invalid_state(&format!("'{}'", instance.name), "the verb of a logical device", "delete", &format!("delete device '{owner}'")));
        }
        self.remove(id);
        Ok(())
    }

    /// Takes an instance out of everything that knows it.
    pub fn remove(&mut self, id: u64) {
        let Some(instance) = self.instances.remove(&id) else { return };
        let mut pairs: Vec<Pair> = instance.crossings.iter().map(|(pair, _, _)| *pair).collect();
        let mut sources = instance.installed.sources.clone();
        let mut windowed = Vec::new();
        for (index, cell) in instance.plan.cells.iter().enumerate() {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let Some(svv) = self.svvs.get_mut(name) else { continue };
            svv.bound -= 1;
            svv.writers.retain(|w| w.instance != id);
            for (block, _) in &cell.readers {
                let source = instance.installed.block_source[*block];
                let count = svv.readers.entry(source).or_default();
                *count -= 1;
                if let Some(home) = svv.home.filter(|home| *count == 0 && *home != source) {
                    pairs.push((home, source));
                }
            }
            if !svv.windows.is_empty() {
                windowed.push(name.clone());
                pairs.extend(svv.discount_windows(&instance.plan, index, &instance.installed.block_source));
            }
        }
        for (source, table) in &mut self.tables {
            let before = (table.outlets.len(), table.inlets.len());
            table.outlets.retain(|o| o.instance != Some(id));
            table.inlets.retain(|i| i.instance != Some(id));
            if instance.installed.sources.contains(source) {
                table.steps.retain(|s| s.instance != id);
            }
            if before != (table.outlets.len(), table.inlets.len()) {
                sources.push(*source);
            }
        }
        sources.extend(self.renew_appends(&windowed, &[]));
        let mut movements: Vec<Movement> = instance.sequence.into_iter().filter(Movement::is_structural).collect();
        movements.extend(self.reconnect(pairs));
        self.detached(movements, sources);
    }

    /// Carries out movements that belong to no instance any more: tables only, and nobody waits for them.
    fn detached(&mut self, movements: Vec<Movement>, mut sources: Vec<SourceId>) {
        for movement in movements {
            match movement {
                Movement::Tables(writers) => sources.extend(writers),
                Movement::Follow { sources, follows } => {
                    for (source, ops) in self.follow_ops(sources, follows) {
                        self.submit(source, ops, crate::core::Purpose::Nothing);
                    }
                }
                Movement::Inbound(inlets) => {
                    for inlet in inlets {
                        sources.push(inlet.reader);
                        self.adopt(inlet);
                    }
                }
                _ => {}
            }
        }
        sources.extend(self.renew_taps());
        sources.sort();
        sources.dedup();
        self.renew_tables(sources);
    }
}

/// Edges within a plan, but for those that its own order could not hold.
fn own_edges(plan: &Plan, installed: &Installed, source: SourceId) -> (Vec<Edge>, Vec<Edge>) {
    let mut position = vec![None; plan.blocks.len()];
    let planned = plan.order.iter().flat_map(|(_, blocks)| blocks).filter(|block| installed.block_source[**block] == source);
    for (at, block) in planned.enumerate() {
        position[*block] = Some(at);
    }
    let (mut hard, mut soft) = (Vec::new(), Vec::new());
    for (cell, (reader, item)) in plan.cells.iter().flat_map(|cell| cell.readers.iter().map(move |reader| (cell, reader))) {
        for (writer, _) in &cell.writers {
            // `None`, of another source, is before everything.
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

/// What a kernel can remember for waits has room for every condition.
fn check_waits(plan: &Plan, installed: &Installed) -> Result<(), Refusals> {
    let waited = Verbatim { plan, installed, devices: &IndexMap::new() }.waited_for().len();
    let count = plan.conditions.len() + waited;
    if waited == 0 || count <= REMEMBERED_MAX {
        return Ok(());
    }
    Err(refuse(
        Class::DefinitionError,
        format!("'{}' has {count} conditions and waits for conditions, more than {REMEMBERED_MAX}", plan.verb),
        "let one termination condition stand for several block conditions, or divide the verb",
    ))
}

/// The SVVs that a block stores, and the private cells that others store too, with what they have in its image.
fn stamped(plan: &Plan, installed: &Installed, block: usize, svvs: &IndexMap<String, SvvRecord>) -> Vec<Stamped> {
    let source = installed.block_source[block];
    let mut found = Vec::new();
    for (index, cell) in plan.cells.iter().enumerate() {
        for (_, item) in cell.writers.iter().filter(|(writer, _)| *writer == block) {
            let svv = if let CellKind::Svv { name, .. } = &cell.kind { svvs.get(name) } else { None };
            let stamps = svv.map(|svv| &svv.stamps).or_else(|| installed.own_stamps.get(&index));
            let Some(stamp) = stamps.and_then(|stamps| stamps.get(&source)).cloned() else { continue };
            let history = svv.and_then(|svv| svv.cells.get(&source).cloned().zip(svv.rings.get(&source).cloned()));
            let ratio = if let Mode::Ratio(n) = mode_of(plan, block, *item) { n } else { 1 };
            found.push(Stamped { block: installed.blocks[block].clone(), ratio, stamp, history });
        }
    }
    found
}

/// The step of one planned block.
fn step(instance: u64, plan: &Plan, installed: &Installed, index: usize, drivers: Drivers) -> StepRecord {
    let planned = &plan.blocks[index];
    let block = installed.blocks[index].clone();
    StepRecord {
        instance,
        id: block.id(),
        block,
        before: installed.before[index].clone(),
        after: installed.after[index].clone(),
        appends: Vec::new(),
        stamped: stamped(plan, installed, index, drivers.0),
        activation: installed.activations[planned.activation].clone(),
        process: installed.process.clone(),
        drivers: step_drivers(plan, installed, index, drivers),
    }
}

fn instance(
    id: u64,
    name: String,
    plan: Arc<Plan>,
    installed: Installed,
    crossings: Vec<(Pair, kernel::Cell, kernel::Cell)>,
    owner: Option<String>,
) -> Instance {
    let list = plan.initial;
    Instance {
        id,
        name,
        plan,
        installed,
        crossings,
        owner,
        origin: None,
        tuned: IndexMap::new(),
        followed: IndexMap::new(),
        state: State::Created,
        starts: 0,
        generation: 0,
        list,
        stage: 0,
        target: (list, 0),
        active: Vec::new(),
        running: RunningTime::default(),
        started_ns: 0,
        limits: Limits::default(),
        wait_until_ns: None,
        overruns_before: 0,
        ending: None,
        sequence: VecDeque::new(),
        outstanding: 0,
        awaited: Vec::new(),
        sent_ns: 0,
        structural: false,
        epoch: 0,
        captured: Vec::new(),
        outputs: Vec::new(),
        capturing: Vec::new(),
        others: Vec::new(),
        report: None,
        halting: false,
        has_entered: false,
        departure: None,
        disabled: false,
        aborted: false,
        is_overtaken: false,
        suspending: false,
        resting_until_ns: None,
        rested: Vec::new(),
        held: Vec::new(),
        entries: (0, 0),
    }
}
