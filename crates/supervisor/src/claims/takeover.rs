// SPDX-License-Identifier: Apache-2.0
//! Takeover at a start: of the SVVs that the instance writes, and of the values that ψ stores.
use crate::movements::carrier::Carrier;
use crate::movements::sequence::{CarriedCell, Movement, Object};
use crate::starting::psi::stored_svvs;
use crate::wiring::homes::first_writer;
use model::interface::Mode;
use model::plan::{CellKind, Plan, Target};

impl Carrier<'_> {
    /// Records the values that ψ stores in SVVs, for images that are created later.
    pub fn keep_stored(&mut self, plan: &Plan, stores: &[(Target, Vec<u8>)]) {
        let now_ns = self.host.now_ns();
        for (_, name, bytes) in stored_svvs(plan, stores) {
            if let Some(record) = self.registry.svvs.get_mut(name) {
                record.keep(bytes, now_ns);
                if record.home.is_none() {
                    self.taps.stored(name, now_ns, bytes);
                }
            }
        }
    }

    /// Moves the SVVs that the instance writes to its sources; replaces connections if the source of the writer changes.
    pub fn take_over(&mut self, id: u64) -> Vec<Movement> {
        let instance = &self.instances[&id];
        let plan = instance.plan.clone();
        let mut homes = instance.installed.homes.clone();
        let (mut written, mut begun) = (Vec::new(), Vec::new());
        for (index, cell) in plan.cells.iter().enumerate() {
            if let (CellKind::Svv { name, .. }, Some((block, item))) = (&cell.kind, first_writer(&plan, index)) {
                let source = instance.installed.block_source[block];
                homes.entry(index).and_modify(|home| *home = source);
                written.push((name.clone(), source));
                let ratio = if let Mode::Ratio(n) = instance.installed.interfaces[block].items[item].mode { u64::from(n) } else { 1 };
                begun.push((ratio, instance.installed.blocks[block].id(), cell.writers.len() > 1));
            }
        }
        let home = |svv: &str| self.registry.svvs.get(svv).and_then(|s| s.home);
        let carried: Vec<CarriedCell> = (written.iter())
            .filter_map(|(svv, to)| Some(CarriedCell { object: Object::Svv(svv.clone()), from: home(svv).filter(|from| from != to)?, to: *to }))
            .collect();
        let pairs = written.iter().flat_map(|(svv, source)| self.registry.hand_over(svv, *source)).collect::<Vec<_>>();
        let mut again = Vec::new();
        for ((name, _), (ratio, block, several)) in written.iter().zip(begun) {
            self.registry.svvs.get_mut(name).expect("the plan was made from the SVVs that exist").ratio = ratio;
            if self.registry.writes(name, block) && several {
                again.push(name.clone());
            }
        }
        self.instances.get_mut(&id).expect("found above").installed.homes = homes;
        let mut movements = Vec::new();
        if !carried.is_empty() {
            movements.extend([Movement::Carry(carried.clone()), Movement::Arrive(carried)]);
        }
        movements.extend(self.reconnect(pairs));
        movements.extend(self.turn_followers(id, &again));
        movements
    }
}
