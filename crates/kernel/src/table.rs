// SPDX-License-Identifier: Apache-2.0
//! Table of the steps that one interrupt source runs.
use crate::bank::{Stretch, Strip, stretches};
use crate::block::{Block, BlockId};
use crate::clock::monotonic_ns;
use crate::containment::{Call, OUTSIDE};
use crate::copies::{Appends, Aside, Copies, append, copy};
use crate::device::Device;
use crate::edge::Edge;
use crate::floats::{self, WatchedBlock};
use crate::memory::{Cell, Span, spans};
use crate::phase::CountedInvocations;
use crate::process::Process;
use crate::running_time::{RunningTime, TimeState};
use crate::schedule::{Activation, Inbound, Outbound};
use crate::source::{Requests, SourceId};
use crate::stamped::{Marks, StampedValue};
use crate::step::{Rows, Step, StepKind, in_driving_order};
use crate::visits::Visits;
use opengpac::abi::Header;
use std::collections::HashMap;
use std::ptr;
use std::sync::Arc;

/// Everything that a source does in a firing. Immutable once built, and swapped as a whole between two firings (`Op::Table`); objects
/// that change while it runs (activations, processes, connections, devices) are shared with the previous and the next table.
pub struct Table {
    /// Calls of the hot loop, in order.
    pub(crate) calls: Vec<Call>,
    pub(crate) strips: Vec<Strip>,
    /// Strips split at their banks, over which the hot loop iterates.
    pub(crate) stretches: Vec<Stretch>,
    /// Order of the probe's visits.
    pub(crate) visits: Visits,
    /// Strips of each activation, as a range in `strips_of`.
    strip_ranges: Vec<(u32, u32)>,
    strips_of: Vec<u32>,
    /// Activations, each once, preceded by its drivers.
    pub activations: Vec<Arc<Activation>>,
    /// True for each activation that is due in this firing; scratch buffer of the kernel.
    pub(crate) due: Vec<bool>,
    /// Data of each step that the hot loop does not need.
    pub steps: Vec<ColdStep>,
    /// True for each step that ran and succeeded in this firing; scratch buffer of the careful mode.
    pub(crate) ran: Vec<bool>,
    /// True for each step selected by `Op::Execute`; scratch buffer of the careful mode.
    pub(crate) chosen: Vec<bool>,
    /// `blind`: true for each activation that reads a lost device. `is_blind`: true if any of them does.
    pub(crate) blind: Vec<bool>,
    pub(crate) is_blind: bool,
    /// Reports of this firing; scratch buffer with space for one per step.
    pub(crate) reports: Vec<Report>,
    /// Scratch buffer for serving reports in order.
    pub(crate) candidates: Vec<Candidate>,
    /// Processes, each once.
    pub processes: Vec<Arc<Process>>,
    /// Running times of the processes in the table's source; filled in when the table is submitted.
    pub(crate) times: Vec<*mut TimeState>,
    pub inbound: Vec<Arc<Inbound>>,
    /// True if an inbound connection has queue members.
    pub(crate) queues: bool,
    pub outbound: Vec<Arc<Outbound>>,
    /// Step that writes each queue member, by outbound connection.
    pub(crate) writers: Vec<Vec<Option<u32>>>,
    /// Requests that each outbound connection raises; filled in when the table is submitted.
    pub(crate) wakes: Vec<Option<Arc<Requests>>>,
    pub devices: Vec<Arc<Device>>,
    pub edges: Vec<Arc<Edge>>,
    /// Requests that each edge raises; filled in when the table is submitted.
    pub(crate) edge_sources: Vec<Option<Arc<Requests>>>,
    pub rows: Vec<(Vec<Span>, Rows)>,
    /// Memory to which the table's blocks store; filled in only if the source is being recorded or played back.
    pub(crate) stored: Vec<Span>,
    /// Maximum of the declared budgets; the flag is true if any activation declares none.
    pub(crate) budget_ns: (u64, bool),
    /// Copy steps, at stable addresses.
    #[allow(clippy::vec_box, reason = "calls hold the address of each")]
    pub copies: Vec<Box<Copies>>,
    /// Steps that append to windows, at stable addresses.
    #[allow(clippy::vec_box, reason = "calls hold the address of each")]
    pub appends: Vec<Box<Appends>>,
    /// Blocks whose invocations are checked one by one, at stable addresses.
    #[allow(clippy::vec_box, reason = "calls hold the address of each")]
    pub(crate) watched: Vec<Box<WatchedBlock>>,
    /// Values that are stamped when the table's blocks store them.
    pub marks: Marks,
}

// SAFETY: a table belongs to one thread at a time: its builder, then the kernel of its source, then the thread that frees it. Its
// pointers lead to what it keeps alive itself.
unsafe impl Send for Table {}
// SAFETY: nothing of a table can be reached through a shared reference from outside; the kernel that has it in force owns it.
unsafe impl Sync for Table {}

pub struct ColdStep {
    /// Block of the step; `None` for copies and appends.
    pub block: Option<Arc<Block>>,
    /// Work done by a step without a block.
    pub aside: Aside,
    pub process: u32,
    pub slot: u32,
    pub drivers: Vec<u32>,
}

/// Result of one step.
#[derive(Clone, Copy)]
pub(crate) struct Report {
    pub(crate) step: u32,
    /// Result as in `abi::outcome`, or `SIGNAL` if the containment aborted the step.
    pub(crate) result: u64,
    pub(crate) now_ns: i64,
}

/// A condition to be served, with its position in the watches of its process.
#[derive(Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) priority: i32,
    pub(crate) order: u32,
    pub(crate) created: u64,
    pub(crate) step: u32,
    /// Process affected by the condition. Not always that of the step, because a stopped source stops all processes.
    pub process: u32,
    pub(crate) item: u8,
    /// Stage and index of the watch that names the condition.
    pub(crate) watch: Option<(u16, u16)>,
    pub(crate) result: u64,
    pub(crate) now_ns: i64,
}

impl Table {
    /// Builds the flat table: maximal runs of steps with one activation become strips. Panics if a step lists a driver that does not
    /// precede it.
    pub fn new(steps: Vec<Step>, inbound: Vec<Arc<Inbound>>, outbound: Vec<Arc<Outbound>>, devices: Vec<Arc<Device>>, rows: Option<Rows>) -> Table {
        let activations = in_driving_order(&steps);
        let slots: HashMap<*const Activation, u32> = activations.iter().zip(0..).map(|(activation, slot)| (Arc::as_ptr(activation), slot)).collect();
        let mut table = Table::empty();
        let mut places: HashMap<*const Process, u32> = HashMap::new();
        table.calls.reserve_exact(steps.len());
        table.steps.reserve_exact(steps.len());
        // Most steps share activation and process with the previous one, and need no look-up.
        let (mut before, mut at) = ((ptr::null(), ptr::null()), (0, 0));
        for (index, step) in steps.into_iter().enumerate() {
            assert!(step.drivers.iter().all(|&driver| (driver as usize) < index), "step {index} is driven by a later one");
            let of = (Arc::as_ptr(&step.activation), Arc::as_ptr(&step.process));
            if of != before {
                let process = *places.entry(of.1).or_insert_with(|| {
                    table.processes.push(step.process.clone());
                    table.processes.len() as u32 - 1
                });
                (before, at) = (of, (slots[&of.0], process));
            }
            table.add(index as u32, at.0, at.1, step);
        }
        table.writers = outbound.iter().map(|outbound| outbound.queue.iter().map(|member| table.writer_of(&member.cell)).collect()).collect();
        let budgets = activations.iter().map(|activation| activation.budget_ns());
        table.budget_ns = (budgets.clone().flatten().max().unwrap_or(0), budgets.clone().any(|budget| budget.is_none()) || activations.is_empty());
        table.due = vec![false; activations.len()];
        table.index_strips(activations.len());
        table.stretches = stretches(&table.strips, &table.calls, &[]);
        let first = |strip: &Strip| table.block_step(strip.start, strip.end);
        table.visits = Visits::begin(table.strips.iter().map(first));
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

    /// Returns the block of each step; `None` for steps without a block.
    pub fn blocks(&self) -> Vec<Option<BlockId>> {
        self.steps.iter().map(|step| step.block.as_ref().map(|block| block.id())).collect()
    }

    /// Adds device channels that raise sources.
    #[must_use]
    pub fn with_edges(mut self, edges: Vec<Arc<Edge>>) -> Table {
        self.edge_sources = edges.iter().map(|_| None).collect();
        self.edges = edges;
        self
    }

    /// Adds rings of rows.
    #[must_use]
    pub fn with_rows(mut self, rows: impl IntoIterator<Item = Rows>) -> Table {
        self.rows.extend(rows.into_iter().map(|rows| (spans(&rows.cells).0, rows)));
        self
    }

    /// Adds values that are stamped when the table's blocks store them; values of other blocks are left out.
    #[must_use]
    pub fn with_stamped(mut self, stamped: Vec<StampedValue>) -> Table {
        let blocks = self.steps.iter().zip(0..).filter_map(|(step, index)| Some((step.block.as_ref()?.id(), index)));
        let steps: HashMap<BlockId, u32> = blocks.collect();
        let found = |block: BlockId| {
            let step = *steps.get(&block)?;
            Some((step, self.steps[step as usize].slot, self.header(step)?.cast_const()))
        };
        self.marks = Marks::new(stamped, self.activations.len(), found);
        self
    }

    /// Creates an empty table.
    pub(crate) fn empty() -> Table {
        Table {
            calls: Vec::new(),
            strips: Vec::new(),
            stretches: Vec::new(),
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
            watched: Vec::new(),
            marks: Marks::default(),
        }
    }

    fn add(&mut self, index: u32, slot: u32, process: u32, step: Step) {
        let mut aside = Aside::None;
        let block = match step.kind {
            StepKind::Block(block) => {
                let (run, instance, watched) = floats::entry(&block);
                self.calls.push(Call { run, instance, invocation: ptr::null() });
                self.watched.extend(watched);
                Some(block)
            }
            StepKind::Copy(cells) => {
                assert!(cells.iter().all(|(from, to)| from.len() == to.len()), "a copy needs two cells of the same length");
                let copies = Box::new(Copies(0, cells));
                self.calls.push(Call { run: copy, instance: ptr::from_ref::<Copies>(&copies).cast_mut().cast(), invocation: ptr::null() });
                aside = Aside::Copy(self.copies.len() as u32);
                self.copies.push(copies);
                None
            }
            StepKind::Append(appends) => {
                assert!(appends.iter().all(|append| append.window.takes(&append.value)), "a window takes values of one length");
                let appends = Box::new(Appends(0, appends));
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

    /// Indexes the strips of each activation, so that switching one activation does not have to visit the strips of the others.
    fn index_strips(&mut self, activations: usize) {
        let mut of: Vec<Vec<u32>> = vec![Vec::new(); activations];
        self.strips.iter().zip(0..).for_each(|(strip, index)| of[strip.slot as usize].push(index));
        for strips in of {
            let start = self.strips_of.len() as u32;
            self.strips_of.extend(strips);
            self.strip_ranges.push((start, self.strips_of.len() as u32));
        }
    }

    /// Returns the steps of the activation at `slot`.
    pub(crate) fn steps_of(&self, slot: usize) -> impl Iterator<Item = u32> {
        let (start, end) = self.strip_ranges[slot];
        self.strips_of[start as usize..end as usize].iter().flat_map(|&strip| self.strips[strip as usize].start..self.strips[strip as usize].end)
    }

    /// Determines which activations read a lost device. Called after a loss, a swap or a reopening. Allocates nothing.
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

    /// Returns true if the activation at `slot` reads a lost device, so that its results are as old as the device's last reading.
    pub(crate) fn is_blind_at(&self, slot: usize) -> bool {
        self.is_blind && self.blind[slot]
    }

    /// Returns the index of `activation` in this table.
    pub(crate) fn slot(&self, activation: &Arc<Activation>) -> Option<usize> {
        // SAFETY: asked by the kernel of its source alone.
        let slot = unsafe { (*activation.state()).slot } as usize;
        self.activations.get(slot).is_some_and(|found| Arc::ptr_eq(found, activation)).then_some(slot)
    }

    /// Fills in everything that depends on the source: running times, and the sources that connections raise. If `stores`, also collects
    /// the memory to which its blocks store, for a record. Off the real-time path.
    pub fn place(&mut self, source: SourceId, raised: impl Fn(SourceId) -> Option<Arc<Requests>>, stores: bool) {
        for (time, process) in self.times.iter_mut().zip(&self.processes) {
            *time = RunningTime::state(process.prepare_time(source));
        }
        for (call, step) in self.calls.iter_mut().zip(&self.steps) {
            // SAFETY: the running time stays as long as its process, which the table holds.
            call.invocation = unsafe { &raw const (*self.times[step.process as usize]).invocation };
        }
        for (wake, outbound) in self.wakes.iter_mut().zip(&self.outbound) {
            *wake = outbound.wake.and_then(&raised);
        }
        for (source, edge) in self.edge_sources.iter_mut().zip(&self.edges) {
            *source = raised(edge.raises);
        }
        if stores {
            let blocks = self.steps.iter().filter_map(|step| step.block.as_ref());
            let cells: Vec<Cell> = blocks.flat_map(|block| block.stores().map(|(_, cell)| cell.clone())).collect();
            self.stored = spans(&cells).0;
        }
    }

    /// Returns the step that the probe visits in this firing: the next block of a strip that is due. Returns `OUTSIDE` if no block is
    /// due.
    pub(crate) fn visit(&mut self) -> u32 {
        let Some((index, step)) = self.visits.due(|strip| self.due[self.strips[strip].slot as usize]) else { return OUTSIDE };
        let strip = self.strips[index];
        let next = self.block_step(step + 1, strip.end).or_else(|| self.block_step(strip.start, strip.end)).unwrap_or(step);
        self.visits.visited(index, next);
        step
    }

    /// Returns the first step in the range that is a block.
    fn block_step(&self, start: u32, end: u32) -> Option<u32> {
        (start..end).find(|&step| self.steps[step as usize].block.is_some())
    }

    /// Runs one step and measures its duration.
    ///
    /// # Safety
    /// Same as for the hot loop: the step must belong to the table in force, and the caller must be the kernel of its source.
    #[inline(never)]
    pub(crate) unsafe fn run_timed(table: *mut Table, step: u32) -> u64 {
        // SAFETY: the caller's.
        unsafe {
            let call = (&(*table).calls)[step as usize];
            let (before_ns, start_ns) = (monotonic_ns(), monotonic_ns());
            let result = (call.run)(call.instance, call.invocation);
            let taken_ns = monotonic_ns() - start_ns - (start_ns - before_ns);
            if let Some(block) = &(&(*table).steps)[step as usize].block {
                block.times().add(taken_ns.max(0) as u64, (*block.header()).number);
            }
            result
        }
    }

    /// Returns the last step whose block stores to `cell`.
    fn writer_of(&self, cell: &Cell) -> Option<u32> {
        self.steps.iter().rposition(|step| step.block.as_ref().is_some_and(|block| block.writes(cell))).map(|step| step as u32)
    }

    /// Returns the header of the block of step `step`.
    pub fn header(&self, step: u32) -> Option<*mut Header> {
        self.steps[step as usize].block.as_ref().map(|block| block.header())
    }
}

/// Maximum number of conditions of one step that are served in one firing; excess conditions are counted as lost.
const CANDIDATES_A_STEP: usize = 4;
