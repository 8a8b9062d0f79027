// SPDX-License-Identifier: Apache-2.0
//! The kernel of one source: state shared by its firings and scripts.
use crate::counters::add;
use crate::event::{Event, Teller};
use crate::memory::Span;
use crate::process::{CAPTURED_MAX, Process};
use crate::process_word::Word;
use crate::shared::{HostState, Source};
use crate::table::Table;
use crate::tape::{Occasion, digest};
use std::sync::Arc;

/// The kernel of one source. Accessed only by the source's own thread or, under the virtual clock, by the only thread.
pub struct Kernel {
    pub source: Arc<Source>,
    pub shared: Arc<HostState>,
    pub table: Box<Table>,
    pub(crate) teller: Teller,
    /// Number of the last firing. Scripts switch intervals on from the next firing.
    pub firing: u64,
    /// True if a step faulted in this firing, or if this is a firing of `execute`; `Table::ran` then contains the steps that ran.
    pub(crate) careful: bool,
    /// True after a firing has ended because of a signal or an exceeded budget: no step runs until a restart.
    pub stopped: bool,
    /// True if an event was sent, so that the supervisor must be woken.
    pub(crate) told: bool,
    /// True if a script has stored values that are not published yet.
    pub(crate) stored: bool,
    /// True if a source was raised and must be woken.
    pub(crate) raised: bool,
    /// Number of the current serving pass.
    pub(crate) pass: u64,
    /// Processes that entered a stage in the current script; their remembered conditions must be checked.
    pub(crate) entered: Vec<*const Process>,
    /// Values captured by a reaction.
    pub(crate) captured: Vec<u8>,
    /// Time budget of a firing if its activations declare none.
    pub(crate) budget_ns: i64,
}

// SAFETY: the pointers of `entered` live only within one script, whose processes it keeps.
unsafe impl Send for Kernel {}

impl Kernel {
    pub fn new(source: Arc<Source>, shared: Arc<HostState>, teller: Teller, firing: u64, budget_ns: i64) -> Kernel {
        let (entered, captured) = (Vec::with_capacity(1024), Vec::with_capacity(CAPTURED_MAX));
        let table = Box::new(Table::empty());
        Kernel {
            source,
            shared,
            table,
            teller,
            firing,
            careful: false,
            stopped: false,
            told: false,
            stored: false,
            raised: false,
            pass: 0,
            entered,
            captured,
            budget_ns,
        }
    }

    /// Begins a segment of the source's record, if the source is being recorded.
    #[inline]
    pub(crate) fn begin(&self) {
        if let Some(tape) = &self.source.tape {
            tape.begin();
        }
    }

    /// Ends the segment of the source's record.
    #[inline]
    pub(crate) fn end(&self, occasion: Occasion, time_ns: i64) {
        if let Some(tape) = self.source.tape.as_ref().filter(|tape| tape.records()) {
            tape.end(occasion, self.firing, time_ns, self.digest(), self.stopped);
        }
    }

    /// Returns the digest of all values stored by the source's blocks.
    pub fn digest(&self) -> u64 {
        // SAFETY: a span lies within its cells, which the table's blocks hold; this source's own image.
        let bytes = |span: &Span| unsafe { std::slice::from_raw_parts(span.start, span.len) };
        self.table.stored.iter().fold(0, |of, span| digest(of, bytes(span)))
    }

    pub(crate) fn tell_asked(&mut self, now_ns: i64) {
        self.tell(Event::Asked { source: self.source.id, time_ns: now_ns }, &[], &[]);
    }

    pub(crate) fn tell(&mut self, event: Event, value: &[u8], captured: &[u8]) {
        self.told = true;
        if !self.teller.tell(&self.shared.serials, event, value, captured) {
            add(&self.source.counters.lost, 1);
        }
    }

    /// Counts a condition that was dropped because the queue was full; the loss is reported once there is room.
    #[cold]
    pub(crate) fn lose(&mut self) {
        self.told = true;
        self.teller.lose();
        add(&self.source.counters.lost, 1);
    }

    /// Wakes the supervisor and raised sources after firings and scripts. Makes a system call only if one of them sleeps.
    pub fn wake(&mut self) {
        if self.raised {
            self.raised = false;
            self.table.wakes.iter().chain(&self.table.edge_sources).flatten().for_each(|source| source.bell.wake());
        }
        self.told |= self.teller.tell_lost(&self.shared.serials);
        if self.told {
            self.told = false;
            self.shared.supervisor.tell();
        }
    }
}

/// Returns the word of a process, which other threads may change concurrently; if there is a tape, the result is recorded or played back.
pub(crate) fn word_of(source: &Source, process: &Process) -> Word {
    let word = process.word();
    source.tape.as_ref().map_or(word, |tape| Word::unpack(tape.number(word.pack())))
}

/// Returns `moved` (true if a process was moved), or the recorded result if a record is played back.
pub(crate) fn is_so(source: &Source, moved: bool) -> bool {
    source.tape.as_ref().map_or(moved, |tape| tape.whether(moved))
}
