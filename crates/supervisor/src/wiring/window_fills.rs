// SPDX-License-Identifier: Apache-2.0
//! Fills an instance's windows at its start, and appends the values of its blocks to them.
use crate::instances::instance::Instance;
use crate::svvs::cells::SvvRecord;
use kernel::{Append, Op, SourceId, Window};
use model::interface::Mode;
use model::plan::CellKind;

impl Instance {
    /// Returns the operations that, at a start, set all values in the windows of a private cell to the initial value of the cell.
    pub fn fill_ops(&self) -> Vec<(SourceId, Op)> {
        let mut ops = Vec::new();
        for ((cell, _), windows) in &self.installed.windows {
            if !matches!(self.plan.cells[*cell].kind, CellKind::Svv { .. }) {
                let fill = |(source, window): (&SourceId, &Window)| {
                    Some((*source, Op::Fill { value: self.installed.cell(*cell, *source)?.clone(), window: window.clone() }))
                };
                ops.extend(windows.iter().filter_map(fill));
            }
        }
        ops
    }

    /// Returns the operations that append a value stored by ψ in a private cell to the cell's windows: where the cell is written, or in
    /// every image if no block writes it.
    pub fn append_ops(&self, cell: usize) -> Vec<(SourceId, Op)> {
        let writer = self.installed.home(&self.plan, cell).filter(|_| !self.plan.cells[cell].writers.is_empty());
        let windows = self.installed.windows.range((cell, 0)..=(cell, u32::MAX)).flat_map(|(_, windows)| windows);
        let images = windows.filter(|(source, _)| writer.is_none_or(|writer| writer == **source));
        images
            .filter_map(|(source, window)| Some((*source, Op::Append { value: self.installed.cell(cell, *source)?.clone(), window: window.clone() })))
            .collect()
    }

    /// Returns the windows to which the values stored by block `block` are appended.
    pub fn appends(&self, block: usize, svvs: &indexmap::IndexMap<String, SvvRecord>) -> Vec<Append> {
        let (installed, source) = (&self.installed, self.installed.block_source[block]);
        let mut appends = Vec::new();
        for (index, cell) in self.plan.cells.iter().enumerate() {
            for (_, item) in cell.writers.iter().filter(|(writer, _)| *writer == block) {
                let windows: Vec<&Window> = match &cell.kind {
                    CellKind::Svv { name, .. } => {
                        svvs.get(name).into_iter().flat_map(|svv| &svv.windows).filter_map(|window| window.cells.get(&source)).collect()
                    }
                    _ => installed.windows.range((index, 0)..=(index, u32::MAX)).filter_map(|(_, windows)| windows.get(&source)).collect(),
                };
                let Some(value) = installed.cell(index, source) else { continue };
                let ratio = if let Mode::Ratio(n) = installed.interfaces[block].items[*item].mode { n } else { 1 };
                let append = |window: &Window| Append { block: installed.blocks[block].clone(), ratio, value: value.clone(), window: window.clone() };
                appends.extend(windows.into_iter().map(append));
            }
        }
        appends
    }
}
