// SPDX-License-Identifier: Apache-2.0
//! Execution of movements: scripts for the kernels, tables, connections, and the values that are moved together with cells. The effect of
//! a movement on the state of its instance is handled elsewhere.
use crate::claims::writers::Pair;
use crate::instances::table::Instances;
use crate::movements::sequence::{CarriedCell, Inlet, Movement, Object, by_source};
use crate::numbers::Numbers;
use crate::observation::record::name_cells;
use crate::observation::taps::Taps;
use crate::registry::Registry;
use crate::scripts::{Purpose, Scripts};
use crate::wiring::tables::Wiring;
use kernel::{Cell, Op, Script, SourceId};
use runtime::Host;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Part of the core that movements change.
pub(crate) struct Carrier<'a> {
    pub host: &'a Host,
    pub registry: &'a mut Registry,
    pub wiring: &'a mut Wiring,
    pub instances: &'a mut Instances,
    pub scripts: &'a mut Scripts,
    pub numbers: &'a mut Numbers,
    pub taps: &'a Taps,
    pub recorded: &'a mut HashMap<(String, SourceId), Cell>,
    pub lost: &'a HashSet<SourceId>,
    pub cut_off: &'a HashSet<SourceId>,
}

impl Carrier<'_> {
    /// Sends operations to a source as one script.
    pub fn submit(&mut self, source: SourceId, ops: Vec<Op>, purpose: Purpose) {
        if let Some(script) = self.script(source, ops, purpose) {
            self.host.submit(source, script);
        }
    }

    /// Builds a script from these operations; `None` if the source is cut off.
    fn script(&mut self, source: SourceId, ops: Vec<Op>, purpose: Purpose) -> Option<Box<Script>> {
        let id = self.numbers.fresh();
        self.scripts.sent(id, purpose);
        if self.host.trace().is_some() && ops.iter().any(|op| matches!(op, Op::Table(_))) {
            name_cells(self.host, &self.registry.svvs, self.recorded, source);
        }
        (!self.cut_off.contains(&source)).then(|| Box::new(Script { id, ops }))
    }

    /// Returns an operation that replaces the table of `source` with one for the current state of the system.
    pub fn table_op(&self, source: SourceId) -> Op {
        self.wiring.table_op(source, self.taps.rings(source))
    }

    /// Replaces the tables of these sources without waiting for the acknowledgement.
    pub fn renew_tables(&mut self, sources: Vec<SourceId>) {
        for source in sources {
            let op = self.table_op(source);
            self.submit(source, vec![op], Purpose::Nothing);
        }
    }

    /// Replaces tables without waking the sources, which is possible because all removed blocks are already inactive.
    pub fn renew_tables_at_leisure(&mut self, sources: Vec<SourceId>) {
        for source in sources {
            let op = self.table_op(source);
            if let Some(script) = self.script(source, vec![op], Purpose::Nothing) {
                self.host.submit_at_leisure(source, script);
            }
        }
    }

    /// Creates new asynchronous groups for these pairs. Returns the movements that must follow.
    pub fn reconnect(&mut self, pairs: Vec<Pair>) -> Vec<Movement> {
        self.wiring.reconnect(self.host, self.registry, pairs)
    }

    /// Stores a value in every image that contains the SVV, and keeps it for images added later.
    pub fn store_everywhere(&mut self, svv: &str, bytes: &[u8]) -> Vec<(SourceId, Op)> {
        let now_ns = self.host.now_ns();
        let Some(record) = self.registry.svvs.get_mut(svv) else { return Vec::new() };
        record.keep(bytes, now_ns);
        if record.home.is_none() {
            self.taps.stored(svv, now_ns, bytes);
        }
        record.store_ops(bytes)
    }

    pub fn send(&mut self, id: u64, scripts: Vec<(SourceId, Vec<Op>)>) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        // A lost source executes the script if it comes back.
        instance.work.awaited.clear();
        instance.work.awaited.extend(scripts.iter().map(|(source, _)| *source).filter(|source| !self.lost.contains(source)));
        instance.work.outstanding = instance.work.awaited.len();
        (instance.work.sent_ns, instance.work.last_call_ns) = (now_ns, None);
        let epoch = instance.work.epoch;
        for (source, ops) in scripts {
            self.submit(source, ops, Purpose::Sequence { instance: id, epoch });
        }
    }

    pub fn swap_tables(&mut self, id: u64, mut sources: Vec<SourceId>) {
        sources.sort();
        sources.dedup();
        let scripts = sources.into_iter().map(|source| (source, vec![self.table_op(source)])).collect();
        self.send(id, scripts);
    }

    /// Replaces the table, then executes `ops` under the new table, in the same script.
    pub fn swap_and_go_on(&mut self, id: u64, source: SourceId, mut ops: Vec<Op>) {
        ops.insert(0, self.table_op(source));
        self.send(id, vec![(source, ops)]);
    }

    pub fn turn_to(&mut self, id: u64, inlets: Vec<Inlet>) {
        let readers = inlets.iter().map(|i| i.reader).collect();
        for inlet in inlets {
            self.wiring.adopt(inlet);
        }
        self.swap_tables(id, readers);
    }

    /// Initialises SVVs that start as copies of others, in every image, from the values captured by the previous script.
    pub fn copy_initial(&mut self, id: u64) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let captured: Vec<u8> = std::mem::take(&mut instance.work.captured).into_iter().flat_map(|(_, bytes)| bytes).collect();
        let Some(owner) = instance.owner.clone() else { return };
        let copies = self.registry.logical[&owner].copies.clone();
        let mut stores = Vec::new();
        let mut offset = 0;
        for (to, _) in copies {
            let size = self.registry.svvs[&to].size;
            let Some(bytes) = captured.get(offset..offset + size) else { continue };
            offset += size;
            stores.extend(self.store_everywhere(&to, bytes));
        }
        self.send(id, by_source(stores));
    }

    /// Returns the cells that move to another source together with a cell, as (cell in the old source, cell in the new source).
    fn carried(&self, id: u64, CarriedCell { object, from, to }: &CarriedCell) -> Vec<(Cell, Cell)> {
        let pair = |cells: &BTreeMap<SourceId, Cell>| cells.get(from).cloned().zip(cells.get(to).cloned());
        match object {
            Object::Svv(name) => {
                let Some(svv) = self.registry.svvs.get(name) else { return Vec::new() };
                pair(&svv.cells).into_iter().chain(pair(&svv.stamps)).chain(svv.carried_windows(*from, *to)).collect()
            }
            Object::Private(cell) => {
                let Some(installed) = self.instances.get(&id).map(|instance| &instance.installed) else { return Vec::new() };
                let stamps = installed.own_stamps.get(cell).and_then(pair);
                pair(&installed.cells[*cell]).into_iter().chain(stamps).chain(installed.crossing_windows(*cell, *from, *to)).collect()
            }
        }
    }

    /// Captures the values that move to another source.
    pub fn carry(&mut self, id: u64, carried: &[CarriedCell]) {
        let cells = |c: &CarriedCell| self.carried(id, c).into_iter().map(|(from, _)| from).collect();
        let captures = by_source(carried.iter().map(|c| (c.from, Op::Capture(cells(c)))));
        self.send(id, captures);
    }

    /// Stores the values that arrive from another source.
    pub fn arrive(&mut self, id: u64, carried: &[CarriedCell]) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let mut captured = std::mem::take(&mut instance.work.captured);
        let mut stores = Vec::new();
        for c in carried {
            let Some((_, bytes)) = captured.iter_mut().find(|(source, _)| *source == c.from) else { continue };
            for (_, cell) in self.carried(id, c) {
                let value: Box<[u8]> = bytes.drain(..cell.len().min(bytes.len())).collect();
                // Cells created between the two scripts were not captured.
                if value.len() == cell.len() {
                    stores.push((c.to, Op::Store(cell, value)));
                }
            }
        }
        self.send(id, by_source(stores));
    }

    /// Resumes a frozen process without waiting for an answer.
    pub fn go_on(&mut self, id: u64) {
        let Some(instance) = self.instances.get(&id) else { return };
        let (process, source) = (instance.installed.process.clone(), instance.installed.sources[0]);
        let (stage, generation) = (process.now().1, Some(instance.generation));
        self.submit(source, vec![Op::Stage { process, stage, generation }], Purpose::Nothing);
    }
}
