// SPDX-License-Identifier: Apache-2.0
//! The reading end of a connection: the cells that a latch fills, and the values that wait for the readers of a queue.
use crate::connection::{End, QueueMember, WORD};
use crate::connection_identity::{Nowhere, Way};
use crate::memory::{Cell, Span, spans};
use crate::phase::{CountedInvocations, State};
use interconnect::Receiver;
use std::cell::UnsafeCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// The reading end, latched once at the start of the reader's firing.
pub struct Inbound<A> {
    state: UnsafeCell<InboundState>,
    /// Release time of the publication that was latched last.
    brought_ns: AtomicI64,
    /// Time since which a ratio value has been missing, plus one; 0 if no value is missing.
    late_ns: AtomicI64,
    spans: Vec<Span>,
    pub members: Vec<QueueMember<A>>,
    pub way: Option<Way>,
    pub group: Vec<Cell>,
}

struct InboundState {
    receiver: Box<dyn Receiver>,
    waiting: Vec<WaitingValues>,
}

/// Values of one member that have arrived but have not been taken yet, in a ring of `DEPTH`.
struct WaitingValues {
    bytes: Box<[u8]>,
    numbers: [u64; DEPTH],
    first: usize,
    count: usize,
    /// Number of values taken so far; a reader that recorded this number has already taken the current value.
    sequence: u64,
    /// Number of the value in the cell, for a ratio member.
    taken: Option<u64>,
    /// Number of the ratio value last found to be late, so that it is counted only once.
    late: Option<u64>,
    /// Number of the newest value of a ratio member that has arrived since the reader was switched on.
    newest: Option<u64>,
    /// Anchor (p, k) of a ratio member n: invocation p of the reader, counted from its activation, takes number k, invocation p + n takes
    /// number k + 1, and so on.
    anchor: (u64, u64),
    /// Number of invocations of a ratio member's reader since its activation, at the last check.
    phase: u64,
    /// True while an active reader has not yet taken the current value.
    held: bool,
}

/// Maximum number of rows taken at once, so that a writer in another process that sends without pause cannot hold up a firing.
const ROWS_MAX: usize = 4096;

/// Maximum number of values of a member buffered on the reader's side; further values wait in the connection's queue.
const DEPTH: usize = 4;

// SAFETY: touched only by the kernel of the reading source.
unsafe impl<A: Send + Sync> Send for Inbound<A> {}
// SAFETY: as for `Send`.
unsafe impl<A: Send + Sync> Sync for Inbound<A> {}

impl<A: CountedInvocations> Inbound<A> {
    /// Creates the inbound side. `group` and `queue` match those of the writing end, but with cells of the reader's image.
    pub fn new(receiver: impl Into<End<dyn Receiver>>, group: Vec<Cell>, queue: Vec<QueueMember<A>>) -> Arc<Inbound<A>> {
        let (spans, _) = spans(&group);
        let waiting = queue.iter().map(|member| WaitingValues::new(member.cell.len(), member.ratio)).collect();
        let End { end: receiver, way } = receiver.into();
        let state = UnsafeCell::new(InboundState { receiver, waiting });
        Arc::new(Inbound { state, brought_ns: AtomicI64::new(i64::MIN), late_ns: AtomicI64::new(0), spans, members: queue, way, group })
    }

    /// Drops the connection's carrier with its descriptors and threads; nothing is received afterwards.
    ///
    /// # Safety
    /// The kernel of the reading source must have ended.
    pub unsafe fn sever(&self) {
        // SAFETY: nobody else touches it any more.
        unsafe { &mut *self.state.get() }.receiver = Box::new(Nowhere::default());
    }

    /// Returns the release time of the firing whose publication was latched last, ns on the clock; `None` before the first.
    pub fn brought_ns(&self) -> Option<i64> {
        Some(self.brought_ns.load(Ordering::Relaxed)).filter(|ns| *ns != i64::MIN)
    }

    /// Returns the time since which a ratio value that its reader needs has been missing, ns on the clock.
    pub fn late_since_ns(&self) -> Option<i64> {
        Some(self.late_ns.load(Ordering::Relaxed) - 1).filter(|ns| *ns >= 0)
    }

    /// Stores `brought_ns` and `late_since_ns` of a remote connection, as last reported by its kernel.
    pub fn report(&self, brought_ns: Option<i64>, late_since_ns: Option<i64>) {
        self.brought_ns.store(brought_ns.unwrap_or(i64::MIN), Ordering::Relaxed);
        self.late_ns.store(late_since_ns.map_or(0, |ns| ns.saturating_add(1)), Ordering::Relaxed);
    }

    /// Copies the newest group into its cells, if there is a new one. Calls `midway` when half of it has been copied.
    ///
    /// # Safety
    /// Must be called only by the kernel of the reading source.
    pub(crate) unsafe fn latch(&self, now_ns: i64, midway: &mut dyn FnMut()) {
        // SAFETY: the caller is the one that touches it.
        let state = unsafe { &mut *self.state.get() };
        let Some(header) = state.receiver.latch(now_ns) else { return };
        self.brought_ns.store(header.time_ns, Ordering::Relaxed);
        let group = state.receiver.group();
        for span in &self.spans {
            let place = &group[span.at..span.at + span.len];
            let half = span.len / 2;
            // SAFETY: a span lies within its cells, which are held.
            unsafe { span.start.copy_from_nonoverlapping(place.as_ptr(), half) };
            midway();
            // SAFETY: as above.
            unsafe { span.start.add(half).copy_from_nonoverlapping(place.as_ptr().add(half), span.len - half) };
        }
    }

    /// Latches the group without preemption points; used by real threads.
    ///
    /// # Safety
    /// Same as for `latch`.
    #[inline]
    pub(crate) unsafe fn latch_at_once(&self, now_ns: i64) {
        // SAFETY: the caller is the one that touches it.
        let state = unsafe { &mut *self.state.get() };
        let Some(header) = state.receiver.latch(now_ns) else { return };
        self.brought_ns.store(header.time_ns, Ordering::Relaxed);
        let group = state.receiver.group();
        for span in &self.spans {
            // SAFETY: a span lies within its cells, which are held, its place within the group.
            unsafe { span.start.copy_from_nonoverlapping(group[span.at..span.at + span.len].as_ptr(), span.len) };
        }
    }

    /// Returns true if the connection has queue members.
    pub(crate) fn queues(&self) -> bool {
        !self.members.is_empty()
    }

    /// Clears the held state of all members.
    ///
    /// # Safety
    /// Same as for `latch`.
    pub(crate) unsafe fn release(&self) {
        // SAFETY: the caller is the one that touches it.
        unsafe { &mut *self.state.get() }.waiting.iter_mut().for_each(|waiting| waiting.held = false);
    }

    /// Marks a member as held if an active reader has not yet taken its current value.
    ///
    /// # Safety
    /// Same as for `latch`.
    pub(crate) unsafe fn hold(&self, member: usize, had: u64) {
        // SAFETY: the caller is the one that touches it.
        let waiting = &mut unsafe { &mut *self.state.get() }.waiting[member];
        waiting.held |= waiting.sequence != had;
    }

    /// Takes the rows that arrived, and the next value of each synchronous member that is not held.
    ///
    /// # Safety
    /// Same as for `latch`.
    pub unsafe fn take(&self) {
        // SAFETY: the caller is the one that touches it.
        let state = unsafe { &mut *self.state.get() };
        self.distribute(state);
        for (member, waiting) in self.members.iter().zip(&mut state.waiting).filter(|(member, _)| member.ratio == 0) {
            if !waiting.held {
                waiting.pop_into(&member.cell);
            }
        }
    }

    /// Takes ratio members by number for the readers that are due: invocation j takes number ⌊j/n⌋ − 1 if both started together.
    /// Otherwise, the first number that arrived is taken from the next invocation on, and the number after it n invocations later. Calls
    /// `late` with each member whose value is missing.
    ///
    /// # Safety
    /// Same as for `latch`.
    pub(crate) unsafe fn take_ratios(&self, now_ns: i64, late: &mut dyn FnMut(u32)) {
        // SAFETY: the caller is the one that touches it.
        let state = unsafe { &mut *self.state.get() };
        self.distribute(state);
        for (index, (member, waiting)) in self.members.iter().zip(&mut state.waiting).enumerate() {
            let Some(activation) = member.activation.as_ref().filter(|_| member.ratio > 0) else { continue };
            // SAFETY: an activation of the reading source.
            let reader = unsafe { &*activation.state() };
            let phase = waiting.attend(reader, member.ratio);
            let (first, number) = waiting.anchor;
            if !reader.due || phase < first {
                continue;
            }
            let wanted = number.saturating_add((phase - first) / u64::from(member.ratio));
            while waiting.count > 0 && waiting.numbers[waiting.first] <= wanted {
                waiting.pop_into(&member.cell);
            }
            if waiting.taken == Some(wanted) {
                self.late_ns.store(0, Ordering::Relaxed);
                continue;
            }
            if self.late_ns.load(Ordering::Relaxed) == 0 {
                self.late_ns.store(now_ns + 1, Ordering::Relaxed);
            }
            if waiting.late != Some(wanted) {
                waiting.late = Some(wanted);
                late(index as u32);
            }
        }
    }

    /// Returns the number of values of `member` taken so far.
    ///
    /// # Safety
    /// Same as for `latch`.
    #[inline]
    pub(crate) unsafe fn sequence(&self, member: usize) -> u64 {
        // SAFETY: the caller is the one that touches it.
        unsafe { &*self.state.get() }.waiting[member].sequence
    }

    /// Drops the pending values of all selected members together, so that no member lags a row behind another. A reader that is switched
    /// on therefore takes no value that arrived earlier.
    ///
    /// # Safety
    /// Same as for `latch`.
    pub(crate) unsafe fn skip(&self, is_skipped: &dyn Fn(usize) -> bool) {
        // SAFETY: the caller is the one that touches it.
        let state = unsafe { &mut *self.state.get() };
        let drop_waiting = |state: &mut InboundState| {
            state.waiting.iter_mut().enumerate().filter(|(member, _)| is_skipped(*member)).for_each(|(_, waiting)| waiting.count = 0);
        };
        loop {
            drop_waiting(state);
            let before = state.receiver.rows();
            if before == 0 {
                break;
            }
            self.distribute(state);
            if state.receiver.rows() >= before {
                break;
            }
        }
        drop_waiting(state);
        for (member, waiting) in state.waiting.iter_mut().enumerate().filter(|(member, _)| is_skipped(*member)) {
            waiting.begin(self.members[member].ratio);
        }
    }

    /// Returns false for a ratio member whose reader is off; the values of such a member are not kept.
    fn is_read(&self, index: usize) -> bool {
        let member = &self.members[index];
        // SAFETY: an activation of the reading source, whose kernel asks.
        member.ratio == 0 || member.activation.as_ref().is_none_or(|activation| unsafe { (*activation.state()).on })
    }

    /// Moves rows that have arrived to their members, as long as all members of a row have space.
    fn distribute(&self, state: &mut InboundState) {
        let masks = self.members.len().div_ceil(64);
        for _ in 0..ROWS_MAX {
            let Some((_, row)) = state.receiver.peek_row() else { return };
            let present = |index: usize| row[index / 8] & (1 << (index % 8)) != 0;
            if (0..self.members.len()).any(|index| present(index) && state.waiting[index].count == DEPTH && self.is_read(index)) {
                return;
            }
            for (index, member) in self.members.iter().enumerate().filter(|(index, _)| present(*index)) {
                let number = u64::from_ne_bytes(row[(masks + index) * WORD..][..WORD].try_into().expect("eight bytes were cut out"));
                if let Some(activation) = member.activation.as_ref().filter(|_| member.ratio > 0) {
                    // SAFETY: an activation of the reading source.
                    state.waiting[index].relate(number, unsafe { &*activation.state() }, member.ratio);
                }
                state.waiting[index].push(number, &row[member.offset..member.offset + member.cell.len()]);
            }
            state.receiver.pop_row();
        }
    }
}

impl WaitingValues {
    fn new(len: usize, ratio: u32) -> WaitingValues {
        WaitingValues {
            bytes: vec![0; len * DEPTH].into(),
            numbers: [0; DEPTH],
            first: 0,
            count: 0,
            sequence: 0,
            taken: None,
            late: None,
            newest: None,
            anchor: (u64::from(ratio), 0),
            phase: 0,
            held: false,
        }
    }

    /// Returns the number of the reader's invocations since its activation. Restarts the numbering if the reader was switched on since
    /// the last check.
    #[inline]
    fn attend(&mut self, reader: &State, ratio: u32) -> u64 {
        let phase = reader.number.saturating_sub(reader.activated);
        if phase < self.phase {
            self.begin(ratio);
        }
        self.phase = phase;
        phase
    }

    /// Restarts the numbering when the reader is switched on.
    #[cold]
    fn begin(&mut self, ratio: u32) {
        (self.taken, self.late, self.newest, self.anchor) = (None, None, None, (u64::from(ratio), 0));
    }

    /// Maps an arriving number `number` of a ratio member to the reader's invocations. The first number after the reader or the writer
    /// was switched on determines the mapping: as if both had started together, unless that is off by more than one update.
    #[inline]
    fn relate(&mut self, number: u64, reader: &State, ratio: u32) {
        if !reader.on {
            // Values are not kept for an inactive reader.
            self.count = 0;
            return;
        }
        let (phase, n) = (self.attend(reader, ratio), u64::from(ratio));
        let begins = self.newest.is_none_or(|newest| number <= newest);
        self.newest = Some(number);
        if begins {
            let together = phase.abs_diff(number.saturating_add(1).saturating_mul(n)) <= n;
            self.anchor = if together { (n, 0) } else { (phase + 1, number) };
            (self.count, self.taken, self.late) = (0, None, None);
        }
    }

    fn push(&mut self, number: u64, bytes: &[u8]) {
        if self.count == DEPTH {
            // The row has been changed by another process since it was checked.
            return;
        }
        let place = (self.first + self.count) % DEPTH;
        self.numbers[place] = number;
        self.bytes[place * bytes.len()..][..bytes.len()].copy_from_slice(bytes);
        self.count += 1;
    }

    fn pop_into(&mut self, cell: &Cell) {
        if self.count == 0 {
            return;
        }
        cell.store(&self.bytes[self.first * cell.len()..][..cell.len()]);
        self.taken = Some(self.numbers[self.first]);
        self.first = (self.first + 1) % DEPTH;
        self.count -= 1;
        self.sequence += 1;
    }
}
