// SPDX-License-Identifier: Apache-2.0
//! Removal of an instance from all registries.
use crate::claims::writers::Pair;
use crate::movements::carrier::Carrier;
use crate::movements::sequence::Movement;
use crate::scripts::Purpose;
use kernel::SourceId;
use model::plan::CellKind;

impl Carrier<'_> {
    /// Removes an instance from all registries. Returns the sources whose tables change.
    pub fn take_out(&mut self, id: u64) -> Vec<SourceId> {
        let Some(instance) = self.instances.remove(&id) else { return Vec::new() };
        let crossings = self.wiring.crossings.remove(&id).unwrap_or_default();
        let mut pairs: Vec<Pair> = crossings.iter().map(|(pair, _, _)| *pair).collect();
        let mut sources = instance.installed.sources.clone();
        let mut windowed = Vec::new();
        for (index, cell) in instance.plan.cells.iter().enumerate() {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let Some(svv) = self.registry.svvs.get_mut(name) else { continue };
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
        for (source, table) in &mut self.wiring.tables {
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
        let mut movements: Vec<Movement> = instance.work.sequence.into_iter().filter(Movement::is_structural).collect();
        movements.extend(self.reconnect(pairs));
        self.detached(movements, sources)
    }

    /// Executes movements that do not belong to any instance, without waiting for them. They only replace tables and connections. Returns
    /// the sources whose tables change.
    fn detached(&mut self, movements: Vec<Movement>, mut sources: Vec<SourceId>) -> Vec<SourceId> {
        for movement in movements {
            match movement {
                Movement::Tables(writers) => sources.extend(writers),
                Movement::Follow { sources, follows } => {
                    for (source, ops) in self.follow_ops(sources, follows) {
                        self.submit(source, ops, Purpose::Nothing);
                    }
                }
                Movement::Inbound(inlets) => {
                    for inlet in inlets {
                        sources.push(inlet.reader);
                        self.wiring.adopt(inlet);
                    }
                }
                _ => {}
            }
        }
        sources
    }
}
