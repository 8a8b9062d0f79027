// SPDX-License-Identifier: Apache-2.0
//! Insertion of the windows that a new instance reads, and of the blocks that append values to them.
use crate::movements::carrier::Carrier;
use crate::movements::sequence::by_source;
use kernel::{Op, SourceId};
use model::plan::CellKind;

/// Scripts, each with the source that executes it.
type Scripts = Vec<(SourceId, Vec<Op>)>;

impl Carrier<'_> {
    /// Creates the windows that a new instance reads, and registers the windows to which this and other instances append. Returns the
    /// scripts to run first in each source, and the sources whose tables change.
    pub fn enter_histories(&mut self, id: u64) -> (Scripts, Vec<SourceId>) {
        let plan = self.instances[&id].plan.clone();
        let (mut fills, mut names) = (Vec::new(), Vec::new());
        for cell in &plan.cells {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let Some(svv) = self.registry.svvs.get_mut(name).filter(|svv| !svv.windows.is_empty()) else { continue };
            names.push(name.clone());
            let home = svv.home.and_then(|home| Some((home, svv.cells.get(&home)?.clone())));
            for window in svv.windows.iter_mut().filter(|window| !window.begun) {
                window.begun = true;
                if let Some(((home, value), window)) = home.clone().and_then(|home| Some((home.clone(), window.cells.get(&home.0)?.clone()))) {
                    fills.push((home, Op::Fill { value, window }));
                }
            }
        }
        (by_source(fills), self.renew_appends(&names, &[id]))
    }

    /// Registers the windows of these SVVs, and of these instances' private cells, with the blocks that append to them. Returns the
    /// sources whose tables change.
    pub fn renew_appends(&mut self, svvs: &[String], instances: &[u64]) -> Vec<SourceId> {
        let writers = svvs.iter().filter_map(|name| self.registry.svvs.get(name)).flat_map(|svv| &svv.writers);
        let mut blocks: Vec<(u64, kernel::BlockId)> = writers.map(|writer| (writer.instance, writer.block)).collect();
        for instance in instances.iter().filter_map(|id| self.instances.get(id)) {
            let writers = instance.installed.windows.keys().flat_map(|(cell, _)| &instance.plan.cells[*cell].writers);
            blocks.extend(writers.map(|(block, _)| (instance.id, instance.installed.blocks[*block].id())));
        }
        let mut changed = Vec::new();
        for (id, block) in blocks {
            let Some(instance) = self.instances.get(&id) else { continue };
            let Some(index) = instance.installed.blocks.iter().position(|of| of.id() == block) else { continue };
            let (appends, source) = (instance.appends(index, &self.registry.svvs), instance.installed.block_source[index]);
            let Some(step) = self.wiring.tables.get_mut(&source).and_then(|table| table.steps.iter_mut().find(|step| step.id == block)) else { continue };
            step.appends = appends;
            changed.push(source);
        }
        changed
    }
}
