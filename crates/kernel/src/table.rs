// SPDX-License-Identifier: Apache-2.0
//! What one interrupt source runs.
use crate::memory::{Span, spans};
use crate::probe::Visits;
use crate::process::{RunningTime, TimeState};
use crate::source::Source;
use crate::stamped::Marks;
use crate::window::Window;
use crate::{Activation, Block, Cell, Device, Edge, Inbound, Outbound, Process, SourceId};
use opengpac::abi::{Header, Invocation, Run};
use std::collections::HashMap;
use std::ffi::c_void;
use std::ptr;
use std::sync::Arc;

/// What a step does.
pub enum StepKind {
    /// One invocation of a block.
    Block(Arc<Block>),
    /// Copies cells: a gather or scatter of an array port, the delay of a ratio input inside a source.
    Copy(Vec<(Cell, Cell)>),
    /// Appends to windows what the block of an earlier step has stored.
    Append(Vec<Append>),
}

/// A value that a block stores, and a window of the last values of it: input items that ask for a history are bound to windows.
#[derive(Clone)]
pub struct Append {
    /// The block that stores it.
    pub block: Arc<Block>,
    /// n where its output is a ratio output n, else 1: it stores on the nth, 2nth, … invocation.
    pub ratio: u32,
    /// The newest value.
    pub value: Cell,
    /// The last values, oldest first.
    pub window: Window,
}

/// One step, with when it is due and whose it is.
pub struct Step {
    /// What it does.
    pub kind: StepKind,
    /// When it is due.
    pub activation: Arc<Activation>,
    /// Whose conditions it reports and whose running time it sees.
    pub process: Arc<Process>,
    /// Indices of the earlier steps of this table whose output it takes synchronously: where one of them faulted in this
    /// firing, or did not run, this one is not due.
    pub drivers: Vec<u32>,
}

/// A ring of rows that the PS, a scope or the recorder reads: these cells are copied into a row at the end of each firing.
pub struct Rows {
    /// In order, without gaps.
    pub cells: Vec<Cell>,
    /// The writing end.
    pub writer: Arc<crate::connection::RowsEnd>,
}

/// Everything that a source does in a firing. Immutable once built, swapped whole between two firings (`Op::Table`); what
/// changes while it runs (activations, processes, connections, devices) is shared with the table before and after it.
pub struct Table {
    /// The hot loop: what to call, in order.
    pub(crate) calls: Vec<Call>,
    pub(crate) strips: Vec<Strip>,
    /// Where the probe goes.
    pub(crate) visits: Visits,
    /// By activation: its strips, as a range of `strips_of`.
    strip_ranges: Vec<(u32, u32)>,
    strips_of: Vec<u32>,
    /// Each activation once, after those that drive it.
    pub(crate) activations: Vec<Arc<Activation>>,
    /// By activation: due in this firing. Scratch of the kernel.
    pub(crate) due: Vec<bool>,
    /// By step: everything that the hot loop does not need.
    pub(crate) steps: Vec<ColdStep>,
    /// By step: ran and succeeded in this firing. Scratch of the careful mode.
    pub(crate) ran: Vec<bool>,
    /// By step: chosen by `Op::Execute`. Scratch of the careful mode.
    pub(crate) chosen: Vec<bool>,
    /// By activation: it reads a lost device; and whether any does.
    pub(crate) blind: Vec<bool>,
    pub(crate) is_blind: bool,
    /// What reported in this firing. Scratch with room for one a step.
    pub(crate) reports: Vec<Report>,
    /// Scratch for serving them in order.
    pub(crate) candidates: Vec<Candidate>,
    /// Each process once.
    pub(crate) processes: Vec<Arc<Process>>,
    /// Their running times in the table's source; filled in when the table is submitted.
    pub(crate) times: Vec<*mut TimeState>,
    pub(crate) inbound: Vec<Arc<Inbound>>,
    /// True where a member of a queue comes in.
    pub(crate) queues: bool,
    pub(crate) outbound: Vec<Arc<Outbound>>,
    /// For each outbound connection and queue member: the step that writes it.
    pub(crate) writers: Vec<Vec<Option<u32>>>,
    /// For each outbound connection: whom it raises; filled in when the table is submitted.
    pub(crate) wakes: Vec<Option<Arc<Source>>>,
    pub(crate) devices: Vec<Arc<Device>>,
    pub(crate) edges: Vec<Arc<Edge>>,
    /// Whom each edge raises; filled in when the table is submitted.
    pub(crate) edge_sources: Vec<Option<Arc<Source>>>,
    pub(crate) rows: Vec<(Vec<Span>, Rows)>,
    /// What its blocks store to; only where a record is made or played.
    pub(crate) stored: Vec<Span>,
    /// The greatest budget declared, and whether some activation declares none.
    pub(crate) budget_ns: (u64, bool),
    /// Copy steps, at addresses that stay.
    #[allow(clippy::vec_box, reason = "calls hold the address of each")]
    pub(crate) copies: Vec<Box<Copies>>,
    /// Steps that append to windows, as above.
    #[allow(clippy::vec_box, reason = "calls hold the address of each")]
    pub(crate) appends: Vec<Box<Appends>>,
    /// Values that are stamped where its blocks store them.
    pub(crate) marks: Marks,
}

// SAFETY: a table belongs to one thread at a time: whoever builds it, then the kernel of its source, then whoever frees it. Its
// pointers lead to what it keeps alive itself.
unsafe impl Send for Table {}
// SAFETY: nothing of a table can be reached through a shared reference from outside; the kernel that has it in force owns it.
unsafe impl Sync for Table {}

/// One call of the hot loop: 24 bytes.
#[derive(Clone, Copy)]
pub(crate) struct Call {
    pub(crate) run: Run,
    pub(crate) instance: *mut c_void,
    pub(crate) invocation: *const Invocation,
}

/// A maximal run of steps with one activation.
#[derive(Clone, Copy)]
pub(crate) struct Strip {
    pub(crate) slot: u32,
    pub(crate) start: u32,
    pub(crate) end: u32,
}

pub(crate) struct ColdStep {
    /// `None` for a copy or an append.
    pub(crate) block: Option<Arc<Block>>,
    /// What a step without a block does.
    pub(crate) aside: Aside,
    pub(crate) process: u32,
    pub(crate) slot: u32,
    pub(crate) drivers: Vec<u32>,
}

/// Which of a table's copies or appends a step is.
#[derive(Clone, Copy)]
pub(crate) enum Aside {
    None,
    Copy(u32),
    Append(u32),
}

/// What one step gave back.
#[derive(Clone, Copy)]
pub(crate) struct Report {
    pub(crate) step: u32,
    /// As `abi::outcome` says, or, ended by the guard, `SIGNAL`.
    pub(crate) result: u64,
    pub(crate) now_ns: i64,
}

/// A condition to be served: where its process's watches have it.
#[derive(Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) priority: i32,
    pub(crate) order: u32,
    pub(crate) created: u64,
    pub(crate) step: u32,
    /// The process; not always that of the step: a stopped source stops all.
    pub(crate) process: u32,
    pub(crate) item: u8,
    /// Stage and line of the watch that names it.
    pub(crate) watch: Option<(u16, u16)>,
    pub(crate) result: u64,
    pub(crate) now_ns: i64,
}

pub(crate) struct Copies(pub(crate) Vec<(Cell, Cell)>);

pub(crate) struct Appends(pub(crate) Vec<Append>);

impl Table {
    /// Builds the flat table: maximal runs of steps with one activation become strips. Panics where a step names a driver that
    /// does not come before it.
    pub fn new(steps: Vec<Step>, inbound: Vec<Arc<Inbound>>, outbound: Vec<Arc<Outbound>>, devices: Vec<Arc<Device>>, rows: Option<Rows>) -> Table {
        let activations = in_driving_order(&steps);
        let slots: HashMap<*const Activation, u32> = activations.iter().zip(0..).map(|(activation, slot)| (Arc::as_ptr(activation), slot)).collect();
        let mut table = Table::empty();
        let mut places: HashMap<*const Process, u32> = HashMap::new();
        for (index, step) in steps.into_iter().enumerate() {
            assert!(step.drivers.iter().all(|&driver| (driver as usize) < index), "step {index} is driven by a later one");
            let process = *places.entry(Arc::as_ptr(&step.process)).or_insert_with(|| {
                table.processes.push(step.process.clone());
                table.processes.len() as u32 - 1
            });
            let slot = slots[&Arc::as_ptr(&step.activation)];
            table.add(index as u32, slot, process, step);
        }
        table.writers = outbound.iter().map(|outbound| outbound.queue.iter().map(|member| table.writer_of(&member.cell)).collect()).collect();
        let budgets = activations.iter().map(|activation| activation.budget_ns());
        table.budget_ns = (budgets.clone().flatten().max().unwrap_or(0), budgets.clone().any(|budget| budget.is_none()) || activations.is_empty());
        table.due = vec![false; activations.len()];
        table.index_strips(activations.len());
        table.index_visits();
        table.ran = vec![false; table.steps.len()];
        table.chosen = vec![false; table.steps.len()];
        table.blind = vec![false; activations.len()];
        table.reports = Vec::with_capacity(2 * table.steps.len() + 1);
        table.candidates = Vec::with_capacity(CANDIDATES_A_STEP * table.steps.len() + table.processes.len() + 1);
        table.times = vec![ptr::null_mut(); table.processes.len()];
        table.wakes = outbound.iter().map(|_| None).collect();
        table.queues = inbound.iter().any(|inbound| inbound.queues());
        Table { activations, inbound, outbound, devices, ..table }.with_rows(rows)
    }

    /// The block of each step.
    pub fn blocks(&self) -> Vec<Option<crate::BlockId>> {
        self.steps.iter().map(|step| step.block.as_ref().map(|block| block.id())).collect()
    }

    /// The same with channels of its devices that raise sources.
    #[must_use]
    pub fn with_edges(mut self, edges: Vec<Arc<Edge>>) -> Table {
        self.edge_sources = edges.iter().map(|_| None).collect();
        self.edges = edges;
        self
    }

    /// The same with more rings of rows.
    #[must_use]
    pub fn with_rows(mut self, rows: impl IntoIterator<Item = Rows>) -> Table {
        self.rows.extend(rows.into_iter().map(|rows| (spans(&rows.cells).0, rows)));
        self
    }

    /// A table without anything.
    pub(crate) fn empty() -> Table {
        Table {
            calls: Vec::new(),
            strips: Vec::new(),
            visits: Visits::default(),
            strip_ranges: Vec::new(),
            strips_of: Vec::new(),
            activations: Vec::new(),
            due: Vec::new(),
            steps: Vec::new(),
            ran: Vec::new(),
            chosen: Vec::new(),
            blind: Vec::new(),
            is_blind: false,
            reports: Vec::new(),
            candidates: Vec::new(),
            processes: Vec::new(),
            times: Vec::new(),
            inbound: Vec::new(),
            queues: false,
            outbound: Vec::new(),
            writers: Vec::new(),
            wakes: Vec::new(),
            devices: Vec::new(),
            edges: Vec::new(),
            edge_sources: Vec::new(),
            rows: Vec::new(),
            stored: Vec::new(),
            budget_ns: (0, true),
            copies: Vec::new(),
            appends: Vec::new(),
            marks: Marks::default(),
        }
    }

    fn add(&mut self, index: u32, slot: u32, process: u32, step: Step) {
        let mut aside = Aside::None;
        let block = match step.kind {
            StepKind::Block(block) => {
                self.calls.push(Call { run: block.descriptor().run, instance: block.instance().cast(), invocation: ptr::null() });
                Some(block)
            }
            StepKind::Copy(cells) => {
                assert!(cells.iter().all(|(from, to)| from.len() == to.len()), "a copy goes between cells of one length");
                let copies = Box::new(Copies(cells));
                self.calls.push(Call { run: copy, instance: ptr::from_ref::<Copies>(&copies).cast_mut().cast(), invocation: ptr::null() });
                aside = Aside::Copy(self.copies.len() as u32);
                self.copies.push(copies);
                None
            }
            StepKind::Append(appends) => {
                assert!(appends.iter().all(|append| append.window.takes(&append.value)), "a window takes values of one length");
                let appends = Box::new(Appends(appends));
                self.calls.push(Call { run: append, instance: ptr::from_ref::<Appends>(&appends).cast_mut().cast(), invocation: ptr::null() });
                aside = Aside::Append(self.appends.len() as u32);
                self.appends.push(appends);
                None
            }
        };
        self.steps.push(ColdStep { block, aside, process, slot, drivers: step.drivers });
        match self.strips.last_mut() {
            Some(strip) if strip.slot == slot => strip.end = index + 1,
            _ => self.strips.push(Strip { slot, start: index, end: index + 1 }),
        }
    }

    /// Finds the strips of each activation, so that switching one visits no others.
    fn index_strips(&mut self, activations: usize) {
        let mut of: Vec<Vec<u32>> = vec![Vec::new(); activations];
        self.strips.iter().zip(0..).for_each(|(strip, index)| of[strip.slot as usize].push(index));
        for strips in of {
            let start = self.strips_of.len() as u32;
            self.strips_of.extend(strips);
            self.strip_ranges.push((start, self.strips_of.len() as u32));
        }
    }

    /// The steps of the activation at `slot`.
    pub(crate) fn steps_of(&self, slot: usize) -> impl Iterator<Item = u32> {
        let (start, end) = self.strip_ranges[slot];
        self.strips_of[start as usize..end as usize].iter().flat_map(|&strip| self.strips[strip as usize].start..self.strips[strip as usize].end)
    }

    /// Looks up which activations read a lost device: after a loss, a swap, and when one was opened again. Allocates nothing.
    pub(crate) fn look_for_blind(&mut self) {
        self.is_blind = self.devices.iter().any(|device| device.is_lost());
        if !self.is_blind {
            return;
        }
        let reads_lost = |block: &Block| self.devices.iter().any(|device| device.is_lost() && device.is_read_by(block));
        for slot in 0..self.activations.len() {
            let blind = self.steps_of(slot).any(|step| self.steps[step as usize].block.as_deref().is_some_and(reads_lost));
            self.blind[slot] = blind;
        }
    }

    /// Whether the activation at `slot` reads a lost device: what it stores is as old as the last reading.
    pub(crate) fn is_blind_at(&self, slot: usize) -> bool {
        self.is_blind && self.blind[slot]
    }

    /// Where `activation` is in this table.
    pub(crate) fn slot(&self, activation: &Arc<Activation>) -> Option<usize> {
        // SAFETY: asked by the kernel of its source alone.
        let slot = unsafe { (*activation.state()).slot } as usize;
        self.activations.get(slot).is_some_and(|found| Arc::ptr_eq(found, activation)).then_some(slot)
    }

    /// Fills in what depends on the source: running times, and whom connections raise. Off the real-time path.
    pub(crate) fn place(&mut self, source: SourceId, sources: &[Arc<Source>]) {
        for (time, process) in self.times.iter_mut().zip(&self.processes) {
            *time = RunningTime::state(process.prepare_time(source));
        }
        for (call, step) in self.calls.iter_mut().zip(&self.steps) {
            // SAFETY: the running time stays as long as its process, which the table holds.
            call.invocation = unsafe { &raw const (*self.times[step.process as usize]).invocation };
        }
        for (wake, outbound) in self.wakes.iter_mut().zip(&self.outbound) {
            *wake = outbound.wake.and_then(|wake| sources.get(wake.0 as usize).cloned());
        }
        for (raised, edge) in self.edge_sources.iter_mut().zip(&self.edges) {
            *raised = sources.get(edge.raises.0 as usize).cloned();
        }
        if sources.get(source.0 as usize).is_some_and(|source| source.tape.is_some()) {
            let blocks = self.steps.iter().filter_map(|step| step.block.as_ref());
            let cells: Vec<Cell> = blocks.flat_map(|block| block.stores().map(|(_, cell)| cell.clone())).collect();
            self.stored = spans(&cells).0;
        }
    }

    /// The step whose block stores to `cell`: the last one.
    fn writer_of(&self, cell: &Cell) -> Option<u32> {
        self.steps.iter().rposition(|step| step.block.as_ref().is_some_and(|block| block.writes(cell))).map(|step| step as u32)
    }

    /// The header of the block of step `step`.
    pub(crate) fn header(&self, step: u32) -> Option<*mut Header> {
        // The instance starts with its header, and the call has its address: no look at the block itself.
        self.steps[step as usize].block.is_some().then(|| self.calls[step as usize].instance.cast())
    }
}

/// Conditions of one step that can be served in one firing; an invocation that reports more tells the rest as lost.
const CANDIDATES_A_STEP: usize = 4;

/// Each activation once, each after those that drive it.
fn in_driving_order(steps: &[Step]) -> Vec<Arc<Activation>> {
    fn visit(activation: &Arc<Activation>, seen: &mut HashMap<*const Activation, ()>, order: &mut Vec<Arc<Activation>>) {
        if seen.insert(Arc::as_ptr(activation), ()).is_none() {
            activation.planned_drivers().iter().for_each(|(driver, _)| visit(driver, seen, order));
            order.push(activation.clone());
        }
    }
    let (mut seen, mut order) = (HashMap::new(), Vec::new());
    steps.iter().for_each(|step| visit(&step.activation, &mut seen, &mut order));
    order
}

/// The entry of a copy step.
unsafe extern "C" fn copy(instance: *mut c_void, _: *const Invocation) -> u64 {
    // SAFETY: the table keeps its copies, and calls each with its own.
    let copies = unsafe { &*instance.cast::<Copies>() };
    for (from, to) in &copies.0 {
        // SAFETY: both cells are held and of one length (checked when the table was built).
        unsafe { ptr::copy(from.start(), to.start(), to.len()) };
    }
    0
}

/// The entry of a step that appends to windows.
unsafe extern "C" fn append(instance: *mut c_void, _: *const Invocation) -> u64 {
    // SAFETY: the table keeps its appends, and calls each with its own.
    let appends = unsafe { &*instance.cast::<Appends>() };
    for append in &appends.0 {
        // SAFETY: the block is held, and its invocation has returned: its number is that of the next one.
        let header = unsafe { &*append.block.header() };
        if header.number.wrapping_sub(header.activated).is_multiple_of(u64::from(append.ratio.max(1))) {
            append.window.append(&append.value);
        }
    }
    0
}
