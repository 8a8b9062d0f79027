// SPDX-License-Identifier: Apache-2.0
//! ω: where an instance's output values lie, and which of them a condition reads in which source.
use crate::stages::Verbatim;
use kernel::SourceId;
use model::plan::Target;

impl Verbatim<'_> {
    /// Outputs that a condition returns and whose value lies in `source`.
    pub fn outputs_in(&self, source: SourceId, condition: usize) -> Vec<usize> {
        let Some(condition) = self.plan.conditions.get(condition) else { return Vec::new() };
        condition.returns.iter().copied().filter(|o| self.output_source(*o) == source).collect()
    }

    /// Where an output's value lies: with the port that writes it, else with one that reads it.
    fn output_source(&self, output: usize) -> SourceId {
        match &self.plan.outputs[output].target {
            Target::Item { block, .. } | Target::Report { block, .. } => self.installed.block_source[*block],
            Target::Cell(cell) => self.cell_source(*cell),
            Target::Cells(cells) => cells.first().map_or(self.installed.sources[0], |c| self.cell_source(*c)),
        }
    }

    fn cell_source(&self, cell: usize) -> SourceId {
        self.installed.home(self.plan, cell).unwrap_or(self.installed.sources[0])
    }

    /// The cells of outputs, in order.
    pub fn cells_of(&self, outputs: &[usize]) -> Vec<kernel::Cell> {
        let mut cells = Vec::new();
        for &output in outputs {
            let source = self.output_source(output);
            match &self.plan.outputs[output].target {
                Target::Item { block, item } => cells.push(self.installed.blocks[*block].value(*item)),
                // Behind its value: whether it was reported at all.
                Target::Report { block, item } => {
                    let block = &self.installed.blocks[*block];
                    cells.extend(block.report(*item).into_iter().chain(block.reported()));
                }
                Target::Cell(cell) => cells.extend(self.installed.cell(*cell, source).cloned()),
                Target::Cells(list) => cells.extend(list.iter().filter_map(|c| self.installed.cell(*c, source).cloned())),
            }
        }
        cells
    }

    /// Length in bytes of an output.
    pub fn output_len(&self, output: usize) -> usize {
        self.cells_of(&[output]).iter().map(kernel::Cell::len).sum()
    }

    /// Outputs in `source` that a kernel reads when it goes to the ending list: those of the condition, and those of the conditions
    /// that an earlier τ may have begun the end with.
    pub fn concluding_outputs(&self, source: SourceId, condition: usize) -> Vec<usize> {
        let led_on = |c: usize| self.plan.lists.iter().any(|l| l.transitions.iter().any(|(on, _)| *on == c));
        let mut outputs = Vec::new();
        for index in std::iter::once(condition).chain((0..self.plan.conditions.len()).filter(|c| led_on(*c))) {
            for output in self.outputs_in(source, index) {
                if !outputs.contains(&output) {
                    outputs.push(output);
                }
            }
        }
        outputs
    }
}
