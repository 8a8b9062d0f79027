// SPDX-License-Identifier: Apache-2.0
//! Homing of cells: before a block writes a cell that is located in another source, the cell is moved to the block's source.
use crate::movements::carrier::Carrier;
use crate::movements::sequence::{CarriedCell, Movement, Object};
use crate::wiring::connect::crossings;
use crate::wiring::ports::mode_of;
use model::interface::Mode;
use model::plan::CellKind;

impl Carrier<'_> {
    /// Moves cells from other sources to the sources of the blocks that are about to write them. `cells` contains pairs (planned cell,
    /// block). Returns the movements that must follow.
    pub fn bring_home(&mut self, id: u64, cells: &[(usize, usize)]) -> Vec<Movement> {
        let Some(instance) = self.instances.get(&id) else { return Vec::new() };
        let plan = instance.plan.clone();
        let (mut carried, mut pairs, mut turned) = (Vec::new(), Vec::new(), Vec::new());
        for &(cell, block) in cells {
            let Some(instance) = self.instances.get_mut(&id) else { return Vec::new() };
            let (to, writer) = (instance.installed.block_source[block], instance.installed.blocks[block].id());
            let from = instance.installed.homes.insert(cell, to);
            match &plan.cells[cell].kind {
                CellKind::Svv { name, .. } => {
                    let from = self.registry.svvs.get(name).and_then(|svv| svv.home).filter(|from| *from != to);
                    carried.extend(from.map(|from| CarriedCell { object: Object::Svv(name.clone()), from, to }));
                    pairs.extend(self.registry.hand_over(name, to));
                    let item = plan.cells[cell].writers.iter().find(|(of, _)| *of == block).map_or(0, |(_, item)| *item);
                    if let Some(svv) = self.registry.svvs.get_mut(name) {
                        svv.ratio = if let Mode::Ratio(n) = mode_of(&plan, block, item) { u64::from(n) } else { 1 };
                    }
                    turned.extend(self.registry.writes(name, writer).then(|| name.clone()));
                }
                CellKind::Private { .. } => {
                    let Some(from) = from.filter(|from| *from != to) else { continue };
                    carried.push(CarriedCell { object: Object::Private(cell), from, to });
                    let now = crossings(&plan, &instance.installed);
                    let before = self.wiring.crossings.insert(id, now.clone()).unwrap_or_default();
                    let both = before.into_iter().chain(now).map(|(pair, ..)| pair);
                    pairs.extend(both.filter(|(writer, _)| *writer == from || *writer == to));
                }
                CellKind::Constant { .. } | CellKind::Channel { .. } => {}
            }
        }
        let mut movements = Vec::new();
        if !carried.is_empty() {
            movements.extend([Movement::Carry(carried.clone()), Movement::Arrive(carried)]);
        }
        movements.extend(self.reconnect(pairs));
        movements.extend(self.turn_all(&turned, id));
        movements
    }

    /// Redirects the followers of an instance's SVVs to the blocks that are now active, after a kernel has advanced the instance within
    /// its source.
    pub fn follow_writers(&mut self, id: u64) -> Vec<Movement> {
        let Some(instance) = self.instances.get(&id) else { return Vec::new() };
        let (plan, mut on) = (instance.plan.clone(), Vec::new());
        for cell in plan.cells.iter().filter(|cell| cell.writers.len() > 1) {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let is_on = |block: usize| instance.position.active.iter().any(|(activation, _)| *activation == plan.blocks[block].activation);
            on.extend(cell.writers.iter().find(|(block, _)| is_on(*block)).map(|(block, _)| (name, instance.installed.blocks[*block].id())));
        }
        let turned: Vec<String> = on.into_iter().filter(|(name, block)| self.registry.writes(name, *block)).map(|(name, _)| name.clone()).collect();
        self.turn_all(&turned, id)
    }
}
