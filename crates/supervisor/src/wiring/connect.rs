// SPDX-License-Identifier: Apache-2.0
//! Connections between sources: the asynchronous group of each pair, and the queues of an instance's synchronous inputs.
//!
//! A pair has one asynchronous group, so that a firing sees one publication of each other source. The group is replaced when its members
//! change: the writer publishes into the new one first, then the reader switches to it. Queues belong to the instance that reads them and
//! are never replaced, so no row is lost.
use crate::claims::writers::Pair;
use crate::movements::sequence::{Inlet, Movement};
use crate::registry::Registry;
use crate::wiring::homes::writer_for;
use crate::wiring::installed::{Gate, InstalledPlan};
use crate::wiring::ports::mode_of;
use crate::wiring::tables::{Crossing, InletRecord, Outlet, Wiring};
use interconnect::{ConnectionSpec, Receiver, Sender};
use kernel::connection::QueueMember;
use kernel::{Activation, BlockId, Cell, End, Inbound, Outbound, Reach, SourceId};
use model::interface::Mode;
use model::plan::{Binding, CellKind, Plan, PlannedCell};
use runtime::Host;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// Number of rows that a queue can hold while the reader is delayed.
const QUEUE_DEPTH: usize = 16;

/// Number of rows for an instance that receives values over a network, which may delay them for a long time and deliver them in bursts.
/// Values that reach the same reader by another path must then wait just as long.
const QUEUE_DEPTH_NETWORK: usize = 256;

/// Writer of a queue member.
enum Author {
    Planned(usize),
    /// Activation of another instance, with n of its ratio output.
    Installed(Arc<Activation>, u32),
}

/// One member of a queue.
struct Member {
    from: Cell,
    to: Cell,
    author: Author,
    /// n of the writer's output if it is a ratio output, otherwise 0.
    author_ratio: u32,
    /// n of the reader's input if it is a ratio input, otherwise 0.
    ratio: u32,
    /// Activation of the plan that reads the member.
    reader: usize,
    /// SVV of another instance that the member carries, if any; that instance may be replaced by another.
    svv: Option<String>,
}

/// A queue between two sources that belongs to one instance, for as long as the instance is installed.
pub(crate) struct Queue {
    pair: Pair,
    members: Vec<Member>,
    ends: (End<dyn Sender>, End<dyn Receiver>),
}

/// Cells of inputs, by (block, item), whose values arrive one at a time through a queue. Each has its own cell because the current value
/// is not always the newest.
pub(crate) type Delays = HashMap<(usize, usize), Cell>;

/// Creates the queues that a plan needs or, with `only`, those for SVVs that other instances write. All values of one block of another
/// instance share one queue, so that its outputs arrive together, however late. Ratio members have their own queue, even within a source,
/// where the queue serves to count them by number.
pub(crate) fn queues(
    registry: &Registry,
    host: &Host,
    plan: &Plan,
    block_source: &[SourceId],
    cells: &[BTreeMap<SourceId, Cell>],
    delays: &Delays,
    only: Option<&[String]>,
) -> Vec<Queue> {
    let mut members: BTreeMap<(Pair, bool, Option<BlockId>), Vec<Member>> = BTreeMap::new();
    for (index, block) in plan.blocks.iter().enumerate() {
        let reader = block_source[index];
        for bound in &block.bindings {
            let ratio = match bound.mode {
                Mode::Synchronous => 0,
                Mode::Ratio(n) => n,
                Mode::Asynchronous => continue,
            };
            let list = match &bound.binding {
                Binding::Cell(cell) => std::slice::from_ref(cell),
                Binding::Cells(list) => list,
            };
            let mut part = 0;
            for cell in list {
                let planned = &plan.cells[*cell];
                let svv = external_svv(planned);
                if !planned.readers.contains(&(index, bound.item)) || only.is_some_and(|only| !svv.is_some_and(|svv| only.iter().any(|of| of == svv))) {
                    part += planned.size;
                    continue;
                }
                let Some((writer, from, author)) = author_of(registry, plan, block_source, cells, (*cell, index)) else { continue };
                if writer == reader && !delays.contains_key(&(index, bound.item)) {
                    part += planned.size;
                    continue;
                }
                let to = delays.get(&(index, bound.item)).map_or_else(|| cells[*cell][&reader].clone(), |whole| whole.part(part, planned.size));
                part += planned.size;
                let author_ratio = if let Author::Installed(_, n) = author { if n > 1 { n } else { 0 } } else { author_ratio(plan, *cell, index) };
                let member = Member { from, to, author, author_ratio, ratio, reader: block.activation, svv: svv.map(str::to_owned) };
                let of = svv.and_then(|svv| registry.driver_of(svv)).map(|writer| writer.block);
                members.entry(((writer, reader), ratio > 0, of)).or_default().push(member);
            }
        }
    }
    let depth = if meets_network(host, block_source, members.keys().map(|(pair, ..)| *pair)) { QUEUE_DEPTH_NETWORK } else { QUEUE_DEPTH };
    members.into_iter().map(|((pair, ..), members)| queue(host, pair, members, depth)).collect()
}

/// Returns true if an instance spans several hosts, or if any of its queues comes from another host.
fn meets_network(host: &Host, block_source: &[SourceId], mut pairs: impl Iterator<Item = Pair>) -> bool {
    let apart = |one: SourceId, other: SourceId| host.reach(one, other) == Reach::Network;
    block_source.split_first().is_some_and(|(first, others)| others.iter().any(|other| apart(*first, *other))) || pairs.any(|(from, to)| apart(from, to))
}

/// Returns n of the planned output that writes a cell for a reader, if it is a ratio output.
fn author_ratio(plan: &Plan, cell: usize, reader: usize) -> u32 {
    match writer_for(plan, cell, reader).map(|(block, item)| mode_of(plan, block, item)) {
        Some(Mode::Ratio(n)) => n,
        _ => 0,
    }
}

/// Returns the writer of a cell for a reader, and its source.
fn author_of(
    registry: &Registry,
    plan: &Plan,
    block_source: &[SourceId],
    cells: &[BTreeMap<SourceId, Cell>],
    (cell, reader): (usize, usize),
) -> Option<(SourceId, Cell, Author)> {
    let planned = &plan.cells[cell];
    if let Some((block, _)) = writer_for(plan, cell, reader) {
        let source = block_source[block];
        return Some((source, cells[cell][&source].clone(), Author::Planned(plan.blocks[block].activation)));
    }
    let CellKind::Svv { name, .. } = &planned.kind else { return None };
    let writer = registry.driver_of(name)?;
    let from = registry.svvs[name].cells.get(&writer.source)?.clone();
    Some((writer.source, from, Author::Installed(writer.activation.clone(), writer.ratio)))
}

/// Returns the SVV of a planned cell if another instance writes it.
fn external_svv(cell: &PlannedCell) -> Option<&str> {
    match &cell.kind {
        CellKind::Svv { name, .. } if cell.writers.is_empty() => Some(name),
        _ => None,
    }
}

/// Returns the offsets of members, after the kernel's own bytes, and the length of a row.
fn lay_out(members: &[Member]) -> (Vec<usize>, usize) {
    let mut end = kernel::row_prefix(members.len());
    let offsets = members
        .iter()
        .map(|m| {
            let at = end;
            end = (at + m.to.len()).next_multiple_of(8);
            at
        })
        .collect();
    (offsets, end)
}

fn queue(host: &Host, pair: Pair, members: Vec<Member>, queue_depth: usize) -> Queue {
    let spec = ConnectionSpec { writer: pair.0.0, reader: pair.1.0, asynchronous_len: 0, queue_row_len: lay_out(&members).1, queue_depth };
    let ends = host.connect(&spec);
    Queue { pair, members, ends }
}

impl Queue {
    fn is_ratio(&self) -> bool {
        self.members.iter().any(|m| m.ratio > 0)
    }

    fn inbound(members: &[Member], receiver: End<dyn Receiver>, activations: &[Arc<Activation>]) -> Arc<Inbound> {
        let (offsets, _) = lay_out(members);
        let member = |(m, offset): (&Member, usize)| {
            let activation = (m.ratio > 0).then(|| activations[m.reader].clone());
            QueueMember { cell: m.to.clone(), offset, activation, ratio: m.ratio }
        };
        Inbound::new(receiver, Vec::new(), members.iter().zip(offsets).map(member).collect())
    }
}

/// A queue whose reading end has already been created.
pub(crate) struct HalfQueue {
    pair: Pair,
    members: Vec<Member>,
    sender: End<dyn Sender>,
    receiver: Option<End<dyn Receiver>>,
    inbound: Option<Arc<Inbound>>,
}

/// Creates the reading ends of the synchronous queues, because the gates of an activation must exist before the activation.
pub(crate) fn open(queues: Vec<Queue>) -> Vec<HalfQueue> {
    let half = |queue: Queue| {
        let ratio = queue.is_ratio();
        let Queue { pair, members, ends: (sender, receiver) } = queue;
        if ratio {
            HalfQueue { pair, members, sender, receiver: Some(receiver), inbound: None }
        } else {
            let inbound = Some(Queue::inbound(&members, receiver, &[]));
            HalfQueue { pair, members, sender, receiver: None, inbound }
        }
    };
    queues.into_iter().map(half).collect()
}

impl HalfQueue {
    /// Returns the members that gate activations of the plan, for their `Due::Queued`.
    pub fn gates(&self) -> impl Iterator<Item = Gate> + '_ {
        let gate = |inbound: &Arc<Inbound>, member: usize, of: &Member| Gate { svv: of.svv.clone(), activation: of.reader, inbound: inbound.clone(), member };
        self.inbound.iter().flat_map(move |inbound| self.members.iter().enumerate().map(move |(member, of)| gate(inbound, member, of)))
    }

    /// Adds both ends to the tables of their sources.
    fn enter(self, wiring: &mut Wiring, instance: u64, installed: &InstalledPlan) {
        let (offsets, _) = lay_out(&self.members);
        let member = |(m, offset): (&Member, usize)| {
            let activation = match &m.author {
                Author::Planned(index) => installed.activations[*index].clone(),
                Author::Installed(activation, _) => activation.clone(),
            };
            QueueMember { cell: m.from.clone(), offset, activation: Some(activation), ratio: m.author_ratio }
        };
        let outbound_members = self.members.iter().zip(offsets).map(member).collect();
        let (writer, reader) = self.pair;
        let svvs: Vec<String> = self.members.iter().filter_map(|m| m.svv.clone()).collect();
        let inbound = match (self.inbound, self.receiver) {
            (Some(inbound), _) => inbound,
            (None, Some(receiver)) => Queue::inbound(&self.members, receiver, &installed.activations),
            (None, None) => return,
        };
        let wake = self.members.iter().any(|m| m.ratio == 0).then_some(reader);
        let outbound = Outbound::new(self.sender, Vec::new(), outbound_members, wake);
        let tables = &mut wiring.tables;
        let of = "a source has its table as long as the system lives";
        tables.get_mut(&writer).expect(of).outlets.push(Outlet { reader, instance: Some(instance), svvs: svvs.clone(), outbound });
        tables.get_mut(&reader).expect(of).inlets.push(InletRecord { writer, instance: Some(instance), svvs, inbound });
    }
}

/// Adds the queues of an instance to the tables. Returns the sources whose tables change.
pub(crate) fn enter_queues(wiring: &mut Wiring, queues: Vec<HalfQueue>, instance: u64, installed: &InstalledPlan) -> Vec<SourceId> {
    let sources = queues.iter().flat_map(|q| [q.pair.0, q.pair.1]).collect();
    for queue in queues {
        queue.enter(wiring, instance, installed);
    }
    sources
}

/// Returns the pairs over which the private cells of an instance are sent asynchronously, with the cells of both ends.
pub(crate) fn crossings(plan: &Plan, installed: &InstalledPlan) -> Vec<Crossing> {
    let mut found = Vec::new();
    for (index, cell) in plan.cells.iter().enumerate() {
        if !matches!(cell.kind, CellKind::Private { .. }) {
            continue;
        }
        let Some(from) = installed.home(plan, index).filter(|_| !cell.writers.is_empty()) else { continue };
        let mut readers: Vec<SourceId> = cell
            .readers
            .iter()
            .filter(|(b, item)| mode_of(plan, *b, *item) == Mode::Asynchronous)
            .map(|(b, _)| installed.block_source[*b])
            .filter(|r| *r != from)
            .collect();
        readers.sort();
        readers.dedup();
        for reader in readers {
            found.push(((from, reader), installed.cells[index][&from].clone(), installed.cells[index][&reader].clone()));
            found.extend(installed.crossing_windows(index, from, reader).map(|(from_cell, to)| ((from, reader), from_cell, to)));
        }
    }
    found
}

impl Wiring {
    /// Creates new asynchronous groups for these pairs, for the current SVVs and instances. Returns the movements that must follow: the
    /// new tables of the writers, then the switch of the readers.
    pub fn reconnect(&mut self, host: &Host, registry: &Registry, mut pairs: Vec<Pair>) -> Vec<Movement> {
        pairs.sort();
        pairs.dedup();
        let (mut writers, mut inlets) = (Vec::new(), Vec::new());
        for (writer, reader) in pairs {
            let members = self.group(registry, writer, reader);
            let outlets = &mut self.tables.get_mut(&writer).expect("a source has its table as long as the system lives").outlets;
            outlets.retain(|o| o.instance.is_some() || o.reader != reader);
            let inbound = (!members.is_empty()).then(|| {
                let (from, to): (Vec<Cell>, Vec<Cell>) = members.into_iter().unzip();
                let spec =
                    ConnectionSpec { writer: writer.0, reader: reader.0, asynchronous_len: from.iter().map(Cell::len).sum(), queue_row_len: 0, queue_depth: 0 };
                let (sender, receiver) = host.connect(&spec);
                outlets.push(Outlet { reader, instance: None, svvs: Vec::new(), outbound: Outbound::new(sender, from, Vec::new(), None) });
                Inbound::new(receiver, to, Vec::new())
            });
            self.last_connection = self.last_connection.next();
            let serial = self.last_connection;
            self.latest.insert((writer, reader), serial);
            writers.push(writer);
            inlets.push(Inlet { serial, reader, writer, inbound });
        }
        if writers.is_empty() {
            return Vec::new();
        }
        writers.dedup();
        vec![Movement::Tables(writers), Movement::Inbound(inlets)]
    }

    /// Returns the members of a pair's asynchronous group, as (cell of the writer, cell of the reader).
    fn group(&self, registry: &Registry, writer: SourceId, reader: SourceId) -> Vec<(Cell, Cell)> {
        let svvs = registry.svvs.values().filter(|s| s.home == Some(writer) && s.readers.get(&reader).is_some_and(|n| *n > 0));
        let of_svvs = svvs.flat_map(|s| {
            let value = s.cells.get(&writer).zip(s.cells.get(&reader)).map(|(from, to)| (from.clone(), to.clone()));
            value.into_iter().chain(s.crossing_windows(writer, reader))
        });
        let of_instances = self.crossings.values().flatten().filter(|(pair, _, _)| *pair == (writer, reader));
        of_svvs.chain(of_instances.map(|(_, from, to)| (from.clone(), to.clone()))).collect()
    }
}
