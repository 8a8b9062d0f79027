// SPDX-License-Identifier: Apache-2.0
//! Where a cell lies that blocks of several sources write, one after the other: with the block that is on. Before such a block runs, the
//! cell comes to its source: value, number, time and windows are carried there, and whoever reads it from another source turns to there.
use crate::connect::{crossings, mode_of};
use crate::core::Core;
use crate::install::Installed;
use crate::sequence::{Builder, Carried, Movement, Object};
use crate::stages::Verbatim;
use kernel::{BlockId, SourceId};
use model::interface::Mode;
use model::plan::{CellKind, Plan, PlannedCommand};
use std::collections::BTreeMap;

/// The source of each cell that has writers in several of them: planned cell → source.
pub(crate) type Homes = BTreeMap<usize, SourceId>;

/// The homes at first: with the first writer of each.
pub(crate) fn first_homes(plan: &Plan, block_source: &[SourceId]) -> Homes {
    let home = |(index, cell): (usize, &model::plan::PlannedCell)| {
        let first = block_source[cell.writers.first()?.0];
        cell.writers.iter().any(|(block, _)| block_source[*block] != first).then_some((index, first))
    };
    plan.cells.iter().enumerate().filter_map(home).collect()
}

/// The (block, item) that writes a planned cell while a reader is on; the first, where none does.
pub(crate) fn writer_for(plan: &Plan, cell: usize, reader: usize) -> Option<(usize, usize)> {
    let writers = &plan.cells[cell].writers;
    if let [] | [_] = writers[..] {
        return writers.first().copied();
    }
    let on = |active: &[(usize, u32)], block: usize| active.iter().any(|(activation, _)| *activation == plan.blocks[block].activation);
    let mut stages = plan.lists.iter().flat_map(|list| &list.stages).filter(|stage| on(&stage.active, reader));
    let together = stages.find_map(|stage| writers.iter().find(|(block, _)| on(&stage.active, *block)));
    together.or(writers.first()).copied()
}

/// The blocks that a command lets run.
fn run_by(plan: &Plan, command: &PlannedCommand) -> Vec<usize> {
    match command {
        PlannedCommand::Execute(blocks) => blocks.clone(),
        PlannedCommand::On { activation, .. } => plan.activations[*activation].blocks.clone(),
        PlannedCommand::Install(_) | PlannedCommand::Off(_) | PlannedCommand::Ready => Vec::new(),
    }
}

/// The (block, item) that writes a planned cell first when a plan begins; the first of all, where none does at once.
pub(crate) fn first_writer(plan: &Plan, cell: usize) -> Option<(usize, usize)> {
    let writers = &plan.cells[cell].writers;
    if let [] | [_] = writers[..] {
        return writers.first().copied();
    }
    let commands = plan.lists[plan.initial].stages.iter().flat_map(|stage| &stage.commands);
    let found = commands.flat_map(|command| run_by(plan, command)).find_map(|of| writers.iter().find(|(block, _)| *block == of));
    found.or(writers.first()).copied()
}

impl Verbatim<'_> {
    /// What a command lets write comes home before it acts; nothing where it is there already.
    pub fn bring(&self, builder: &mut Builder, command: &PlannedCommand) {
        if self.installed.homes.is_empty() {
            return;
        }
        let mut cells: Vec<(usize, usize)> = Vec::new();
        for block in run_by(self.plan, command) {
            let source = self.installed.block_source[block];
            for &cell in self.installed.homes.keys().filter(|cell| self.plan.cells[**cell].writers.iter().any(|(writer, _)| *writer == block)) {
                if builder.homes.insert(cell, source) != Some(source) {
                    cells.push((cell, block));
                }
            }
        }
        if !cells.is_empty() {
            builder.then(Movement::Home(cells));
        }
    }

    /// The homes while the commands of a stage have been carried out: those that an active block says.
    pub fn homes_in(&self, list: usize, stage: usize) -> Homes {
        let active = &self.plan.lists[list].stages[stage].active;
        let is_on = |block: usize| active.iter().any(|(activation, _)| *activation == self.plan.blocks[block].activation);
        let of = |cell: &usize| {
            let writer = self.plan.cells[*cell].writers.iter().find(|(block, _)| is_on(*block))?;
            Some((*cell, self.installed.block_source[writer.0]))
        };
        self.installed.homes.keys().filter_map(of).collect()
    }

    /// True where an output lies now in one source, now in another: no kernel reads it alone.
    pub fn moves(&self, output: usize) -> bool {
        use model::plan::Target;
        match &self.plan.outputs[output].target {
            Target::Cell(cell) => self.installed.homes.contains_key(cell),
            Target::Cells(cells) => cells.iter().any(|cell| self.installed.homes.contains_key(cell)),
            Target::Item { .. } | Target::Report { .. } => false,
        }
    }
}

impl Core {
    /// Blocks are about to write these cells: (planned cell, block). Those that lie with another source come to theirs.
    pub fn bring_home(&mut self, id: u64, cells: &[(usize, usize)]) {
        let Some(instance) = self.instances.get(&id) else { return };
        let plan = instance.plan.clone();
        let (mut carried, mut pairs, mut turned) = (Vec::new(), Vec::new(), Vec::new());
        for &(cell, block) in cells {
            let Some(instance) = self.instances.get_mut(&id) else { return };
            let (to, writer) = (instance.installed.block_source[block], instance.installed.blocks[block].id());
            let from = instance.installed.homes.insert(cell, to);
            match &plan.cells[cell].kind {
                CellKind::Svv { name, .. } => {
                    let from = self.svvs.get(name).and_then(|svv| svv.home).filter(|from| *from != to);
                    carried.extend(from.map(|from| Carried { object: Object::Svv(name.clone()), from, to }));
                    pairs.extend(self.hand_over(name, to));
                    let item = plan.cells[cell].writers.iter().find(|(of, _)| *of == block).map_or(0, |(_, item)| *item);
                    if let Some(svv) = self.svvs.get_mut(name) {
                        svv.ratio = if let Mode::Ratio(n) = mode_of(&plan, block, item) { u64::from(n) } else { 1 };
                    }
                    turned.extend(self.writes(name, writer).then(|| name.clone()));
                }
                CellKind::Private { .. } => {
                    let Some(from) = from.filter(|from| *from != to) else { continue };
                    carried.push(Carried { object: Object::Private(cell), from, to });
                    pairs.extend(instance.crossings.iter().map(|(pair, ..)| *pair).filter(|(writer, _)| *writer == from || *writer == to));
                    instance.crossings = crossings(&plan, &instance.installed);
                    pairs.extend(instance.crossings.iter().map(|(pair, ..)| *pair).filter(|(writer, _)| *writer == from || *writer == to));
                }
                CellKind::Constant { .. } | CellKind::Channel { .. } => {}
            }
        }
        let mut movements = Vec::new();
        if !carried.is_empty() {
            movements.extend([Movement::Carry(carried.clone()), Movement::Arrive(carried)]);
        }
        movements.extend(self.reconnect(pairs));
        for svv in turned {
            movements.extend(self.turn_all(&svv, id));
        }
        let rows = self.renew_taps();
        if !rows.is_empty() {
            movements.push(Movement::Tables(rows));
        }
        let Some(instance) = self.instances.get_mut(&id) else { return };
        movements.into_iter().rev().for_each(|movement| instance.sequence.push_front(movement));
    }

    /// A block of the instance that has claimed an SVV writes it from now on; true where it was another one before.
    pub fn writes(&mut self, svv: &str, block: BlockId) -> bool {
        self.svvs.get_mut(svv).is_some_and(|svv| svv.written_by.replace(block) != Some(block))
    }

    /// A kernel has moved an instance on within its source: those that follow its SVVs turn to the blocks that are on now.
    pub fn follow_writers(&mut self, id: u64) -> Vec<Movement> {
        let Some(instance) = self.instances.get(&id) else { return Vec::new() };
        let (plan, mut on) = (instance.plan.clone(), Vec::new());
        for cell in plan.cells.iter().filter(|cell| cell.writers.len() > 1) {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let is_on = |block: usize| instance.active.iter().any(|(activation, _)| *activation == plan.blocks[block].activation);
            on.extend(cell.writers.iter().find(|(block, _)| is_on(*block)).map(|(block, _)| (name, instance.installed.blocks[*block].id())));
        }
        let turned: Vec<&String> = on.into_iter().filter(|(name, block)| self.writes(name, *block)).map(|(name, _)| name).collect();
        turned.into_iter().flat_map(|svv| self.turn_all(svv, id)).collect()
    }
}

impl Installed {
    /// The source in which a planned cell is written now; with a reader, where nothing writes it.
    pub fn home(&self, plan: &Plan, cell: usize) -> Option<SourceId> {
        let planned = &plan.cells[cell];
        let first = || planned.writers.first().or(planned.readers.first()).map(|(block, _)| self.block_source[*block]);
        self.homes.get(&cell).copied().or_else(first)
    }
}
