// SPDX-License-Identifier: Apache-2.0
//! Homes of cells that are written by blocks of several sources: before a command makes such a block run, the cell is moved to the
//! block's source.
use crate::instances::installed_verb::InstalledVerb;
use crate::movements::sequence::{Builder, Movement};
use crate::wiring::homes::run_by;
use crate::wiring::installed::Homes;
use model::plan::PlannedCommand;

impl InstalledVerb<'_> {
    /// Moves cells to their new homes before a command takes effect. These are the cells that the command's blocks may write, unless they
    /// are already there.
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

    /// Returns the homes after the commands of a stage, which are determined by the active blocks.
    pub fn homes_in(&self, list: usize, stage: usize) -> Homes {
        let active = &self.plan.lists[list].stages[stage].active;
        let is_on = |block: usize| active.iter().any(|(activation, _)| *activation == self.plan.blocks[block].activation);
        let of = |cell: &usize| {
            let writer = self.plan.cells[*cell].writers.iter().find(|(block, _)| is_on(*block))?;
            Some((*cell, self.installed.block_source[writer.0]))
        };
        self.installed.homes.keys().filter_map(of).collect()
    }

    /// Returns true if an output is located in different sources at different times, so that no kernel can read it alone.
    pub fn moves(&self, output: usize) -> bool {
        use model::plan::Target;
        match &self.plan.outputs[output].target {
            Target::Cell(cell) => self.installed.homes.contains_key(cell),
            Target::Cells(cells) => cells.iter().any(|cell| self.installed.homes.contains_key(cell)),
            Target::Item { .. } | Target::Report { .. } => false,
        }
    }
}
