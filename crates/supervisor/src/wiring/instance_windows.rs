// SPDX-License-Identifier: Apache-2.0
//! Windows that the blocks of an instance read, created with its memory.
use crate::registry::Registry;
use crate::svvs::windows::{asked, window};
use crate::wiring::installed::{InstalledPlan, Windows};
use kernel::{Cell, SourceId};
use model::plan::{CellKind, Plan};
use std::collections::BTreeMap;

/// Creates the windows that a plan needs: for private cells in separate memory, for SVVs at their locations. If the plan writes an SVV,
/// the SVV's windows are also created in the writer's image.
pub(crate) fn make_windows(registry: &mut Registry, plan: &Plan, block_source: &[SourceId], cells: &[BTreeMap<SourceId, Cell>]) -> Windows {
    let mut windows = Windows::new();
    for ((cell, count), mut sources) in asked(plan, block_source) {
        let planned = &plan.cells[cell];
        sources.extend(planned.writers.iter().map(|(block, _)| block_source[*block]));
        let of = match &planned.kind {
            CellKind::Svv { name, .. } => {
                let svv = registry.svvs.get_mut(name).expect("the plan was made from the SVVs that exist");
                sources.extend(svv.writers.iter().map(|writer| writer.source).chain(svv.home));
                sources.into_iter().map(|source| (source, svv.window(count, source))).collect()
            }
            _ => sources
                .into_iter()
                .filter(|source| cells[cell].contains_key(source))
                .map(|source| (source, window(planned.size, count, &planned.initial)))
                .collect(),
        };
        windows.insert((cell, count), of);
    }
    for cell in &plan.cells {
        let CellKind::Svv { name, .. } = &cell.kind else { continue };
        let Some(svv) = registry.svvs.get_mut(name) else { continue };
        for (block, _) in &cell.writers {
            let counts: Vec<u32> = svv.windows.iter().map(|window| window.count).collect();
            for count in counts {
                svv.window(count, block_source[*block]);
            }
        }
    }
    windows
}

impl InstalledPlan {
    /// Returns the windows of a private cell that are sent between two sources.
    pub fn crossing_windows(&self, cell: usize, from: SourceId, to: SourceId) -> impl Iterator<Item = (Cell, Cell)> + '_ {
        let of = self.windows.range((cell, 0)..=(cell, u32::MAX));
        of.filter_map(move |(_, windows)| Some((windows.get(&from)?.cell().clone(), windows.get(&to)?.cell().clone())))
    }
}
