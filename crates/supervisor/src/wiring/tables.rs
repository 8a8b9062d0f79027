// SPDX-License-Identifier: Apache-2.0
//! Blocks of each source, as recorded by the supervisor, and the tables built from them.
use crate::claims::writers::Pair;
use crate::movements::sequence::{Inlet, Serial};
use crate::wiring::fusing::{Candidate, Fusing, candidates};

use kernel::Rows;
use kernel::{Activation, Append, Block, BlockId, Cell, Device, Edge, Inbound, Op, Outbound, Process, SourceId, StampedValue, Step, StepKind, Table};
use runtime::Host;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// A step of an installed instance, in firing order.
pub(crate) struct StepRecord {
    pub instance: u64,
    pub id: BlockId,
    pub block: Arc<Block>,
    /// Copies before and after the invocation: gathers and scatters.
    pub before: Vec<(Cell, Cell)>,
    pub after: Vec<(Cell, Cell)>,
    /// Windows to which the values stored by the step are appended.
    pub appends: Vec<Append>,
    /// SVVs that the step stores.
    pub stamped: Vec<StampedValue>,
    pub activation: Arc<Activation>,
    pub process: Arc<Process>,
    /// Blocks on the same source that drive the step synchronously.
    pub drivers: Vec<BlockId>,
}

/// An outbound connection of a source.
pub(crate) struct Outlet {
    pub reader: SourceId,
    /// Instance whose synchronous members the connection carries; `None` for the asynchronous group of the pair.
    pub instance: Option<u64>,
    /// SVVs of other instances that the connection carries.
    pub svvs: Vec<String>,
    pub outbound: Arc<Outbound>,
}

/// An inbound connection of a source.
pub(crate) struct InletRecord {
    pub writer: SourceId,
    pub instance: Option<u64>,
    pub svvs: Vec<String>,
    pub inbound: Arc<Inbound>,
}

/// Contents of the table of one source.
#[derive(Default)]
pub(crate) struct SourceTable {
    pub steps: Vec<StepRecord>,
    pub outlets: Vec<Outlet>,
    pub inlets: Vec<InletRecord>,
    pub devices: Vec<Arc<Device>>,
    /// Device channels that raise sources.
    pub edges: Vec<(String, Arc<Edge>)>,
}

/// A cell whose value is sent asynchronously: its pair, the writer's cell, and the reader's cell.
pub(crate) type Crossing = (Pair, Cell, Cell);

/// Blocks of each source, and connections between sources.
#[derive(Default)]
pub(crate) struct Wiring {
    pub tables: BTreeMap<SourceId, SourceTable>,
    /// Latest connection of each pair.
    pub latest: HashMap<Pair, Serial>,
    pub last_connection: Serial,
    /// Private cells of each instance that are sent between sources.
    pub crossings: BTreeMap<u64, Vec<Crossing>>,
    pub fusing: Fusing,
}

impl Wiring {
    /// Releases the carriers of connections after the kernels have exited.
    pub fn sever(&self, host: &Host) {
        for table in self.tables.values() {
            host.sever(table.inlets.iter().map(|inlet| &*inlet.inbound), table.outlets.iter().map(|outlet| &*outlet.outbound));
        }
    }
}

impl SourceTable {
    /// Builds the current table, without the rings of taps.
    fn build(&self) -> Table {
        let mut index_of: HashMap<BlockId, u32> = HashMap::with_capacity(self.steps.len());
        let mut steps: Vec<Step> = Vec::with_capacity(self.steps.len());
        for record in &self.steps {
            let step = |kind, drivers| Step { kind, activation: record.activation.clone(), process: record.process.clone(), drivers };
            if !record.before.is_empty() {
                steps.push(step(StepKind::Copy(record.before.clone()), vec![]));
            }
            let block_index = steps.len() as u32;
            index_of.insert(record.id, block_index);
            let drivers = record.drivers.iter().filter_map(|id| index_of.get(id).copied()).collect();
            steps.push(step(StepKind::Block(record.block.clone()), drivers));
            if !record.after.is_empty() {
                steps.push(step(StepKind::Copy(record.after.clone()), vec![block_index]));
            }
            if !record.appends.is_empty() {
                steps.push(step(StepKind::Append(record.appends.clone()), vec![block_index]));
            }
        }
        let outbound = self.outlets.iter().map(|o| o.outbound.clone()).collect();
        let inbound = self.inlets.iter().map(|i| i.inbound.clone()).collect();
        let stamped = self.steps.iter().flat_map(|record| record.stamped.iter().cloned()).collect();
        let edges = self.edges.iter().map(|(_, edge)| edge.clone()).collect();
        Table::new(steps, inbound, outbound, self.devices.clone(), None).with_edges(edges).with_stamped(stamped)
    }

    /// Returns the groups of blocks of the table that can be fused.
    pub fn candidates(&self) -> Vec<Candidate> {
        candidates(self.build())
    }
}

impl Wiring {
    /// Returns an operation that replaces the table of `source` with one for the current state of the system; `rows` contains the rings
    /// read by taps.
    pub fn table_op(&self, source: SourceId, rows: impl IntoIterator<Item = Rows>) -> Op {
        Op::Table(Box::new(self.fusing.fuse(self.tables[&source].build()).with_rows(rows)))
    }

    /// Replaces the reading end of an asynchronous group with this one. An end that has been superseded by a later connection of the pair
    /// is dropped.
    pub fn adopt(&mut self, inlet: Inlet) {
        if self.latest.get(&(inlet.writer, inlet.reader)) != Some(&inlet.serial) {
            return;
        }
        let table = self.tables.get_mut(&inlet.reader).expect("a source has its table as long as the system lives");
        table.inlets.retain(|i| i.instance.is_some() || i.writer != inlet.writer);
        if let Some(inbound) = inlet.inbound {
            table.inlets.push(InletRecord { writer: inlet.writer, instance: None, svvs: Vec::new(), inbound });
        }
    }
}
