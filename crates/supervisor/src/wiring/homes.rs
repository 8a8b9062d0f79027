// SPDX-License-Identifier: Apache-2.0
//! Homes of cells. A cell that blocks of several sources write in turn has a home: the source of the block that currently writes it.
//! Before a block of another source runs, the cell is moved to that source, with its value, number, time and windows, and readers in
//! other sources are switched to it.
use crate::wiring::installed::Homes;
use kernel::SourceId;
use model::plan::{Plan, PlannedCommand};

/// Returns the initial homes: the source of each cell's first writer.
pub(crate) fn first_homes(plan: &Plan, block_source: &[SourceId]) -> Homes {
    let home = |(index, cell): (usize, &model::plan::PlannedCell)| {
        let first = block_source[cell.writers.first()?.0];
        cell.writers.iter().any(|(block, _)| block_source[*block] != first).then_some((index, first))
    };
    plan.cells.iter().enumerate().filter_map(home).collect()
}

/// Returns the (block, item) that writes a planned cell while a reader is active, or else the first writer.
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

/// Returns the blocks that a command causes to run.
pub(crate) fn run_by(plan: &Plan, command: &PlannedCommand) -> Vec<usize> {
    match command {
        PlannedCommand::Execute(blocks) => blocks.clone(),
        PlannedCommand::On { activation, .. } => plan.activations[*activation].blocks.clone(),
        PlannedCommand::Install(_) | PlannedCommand::Off(_) | PlannedCommand::Ready => Vec::new(),
    }
}

/// Returns the (block, item) that is the first to write a planned cell when a plan begins, or else the first of its writers.
pub(crate) fn first_writer(plan: &Plan, cell: usize) -> Option<(usize, usize)> {
    let writers = &plan.cells[cell].writers;
    if let [] | [_] = writers[..] {
        return writers.first().copied();
    }
    let commands = plan.lists[plan.initial].stages.iter().flat_map(|stage| &stage.commands);
    let found = commands.flat_map(|command| run_by(plan, command)).find_map(|of| writers.iter().find(|(block, _)| *block == of));
    found.or(writers.first()).copied()
}
