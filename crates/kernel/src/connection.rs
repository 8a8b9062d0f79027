// SPDX-License-Identifier: Apache-2.0
//! Connections between interrupt sources, seen from the kernel: which cells a publication takes and which a latch fills.
//!
//! A row of a queue starts with [`row_prefix`] bytes: one bit for each member that is in the row, then the number of each
//! member's update. The members' values follow, where `QueueMember::offset` says.
use crate::far::Way;
use crate::memory::{Span, spans};
use crate::{Activation, Cell};
use interconnect::{Full, Receiver, Sender};
use std::cell::UnsafeCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// A member of a connection's queue.
pub struct QueueMember {
    /// In the writer's image (outbound) or the reader's (inbound).
    pub cell: Cell,
    /// Where it lies in a row, from [`row_prefix`] of the connection's number of members on.
    pub offset: usize,
    /// The writer's activation (outbound): the member is in the rows of the firings in which it was due and did not fault. Of a
    /// ratio input (inbound): the reader's activation, whose invocations choose the row.
    pub activation: Option<Arc<Activation>>,
    /// Inbound: 0 for a synchronous member, n for a ratio input n (taken by number). Outbound: n where the writer's output is a
    /// ratio output n, else 0.
    pub ratio: u32,
}

/// Bytes at the start of a row of `members` members that the kernel uses itself.
pub fn row_prefix(members: usize) -> usize {
    WORD * (members.div_ceil(64) + members)
}

const WORD: usize = 8;

/// One end of a connection, and, where the other may lie elsewhere, how both are named.
pub struct End<T: ?Sized> {
    /// The end itself.
    pub end: Box<T>,
    /// None where both were made together.
    pub way: Option<Way>,
}

impl<T: ?Sized> From<Box<T>> for End<T> {
    fn from(end: Box<T>) -> Self {
        End { end, way: None }
    }
}

/// The writing end: a publication of the group once a firing, a row in the queue when a queue member was updated. It raises
/// `wake` (a software source) after publishing, where asked.
pub struct Outbound {
    sender: UnsafeCell<Box<dyn Sender>>,
    spans: Vec<Span>,
    group_len: usize,
    pub(crate) queue: Vec<QueueMember>,
    pub(crate) wake: Option<crate::SourceId>,
    pub(crate) way: Option<Way>,
    pub(crate) group: Vec<Cell>,
}

// SAFETY: the sender and the cells are touched only by the kernel of the writing source.
unsafe impl Send for Outbound {}
// SAFETY: as for `Send`.
unsafe impl Sync for Outbound {}

impl Outbound {
    /// `group`: the asynchronous members, in the order in which they lie in the group. `wake` is raised once a firing in which a
    /// row was sent, or, of a connection without a queue, in each firing.
    pub fn new(sender: impl Into<End<dyn Sender>>, group: Vec<Cell>, queue: Vec<QueueMember>, wake: Option<crate::SourceId>) -> Arc<Outbound> {
        let (spans, group_len) = spans(&group);
        let End { end, way } = sender.into();
        Arc::new(Outbound { sender: UnsafeCell::new(end), spans, group_len, queue, wake, way, group })
    }

    /// Publishes the group. `midway` is called with half of it copied.
    ///
    /// # Safety
    /// Called by the kernel of the writing source alone.
    pub(crate) unsafe fn publish(&self, number: u64, now_ns: i64, midway: &mut dyn FnMut()) {
        if self.group_len == 0 {
            return;
        }
        // SAFETY: the caller is the one that touches it.
        let sender = unsafe { &mut *self.sender.get() };
        let group = sender.group();
        debug_assert!(group.len() >= self.group_len);
        let half = self.group_len / 2;
        for span in &self.spans {
            let first = half.saturating_sub(span.at).min(span.len);
            // SAFETY: a span lies within its cells, which are held, and its place within the group.
            unsafe { group[span.at..].as_mut_ptr().copy_from_nonoverlapping(span.start, first) };
        }
        midway();
        for span in &self.spans {
            let first = half.saturating_sub(span.at).min(span.len);
            let place = group[span.at..span.at + span.len].as_mut_ptr();
            // SAFETY: as above.
            unsafe { place.add(first).copy_from_nonoverlapping(span.start.add(first), span.len - first) };
        }
        sender.publish(number, now_ns);
    }

    /// Publishes the group in one go: the path of real threads.
    ///
    /// # Safety
    /// As for `publish`.
    #[inline]
    pub(crate) unsafe fn publish_at_once(&self, number: u64, now_ns: i64) {
        if self.group_len == 0 {
            return;
        }
        // SAFETY: the caller is the one that touches it.
        let sender = unsafe { &mut *self.sender.get() };
        let group = sender.group();
        for span in &self.spans {
            let place = group[span.at..span.at + span.len].as_mut_ptr();
            // SAFETY: a span lies within its cells, which are held.
            unsafe { place.copy_from_nonoverlapping(span.start, span.len) };
        }
        sender.publish(number, now_ns);
    }

    /// Sends a row with the members that were updated in this firing; `stored(m)` says whether the step that writes member m
    /// succeeded. Gives whether the reader is to be raised, or the first member of a row that was lost.
    ///
    /// # Safety
    /// As for `publish`.
    pub(crate) unsafe fn push(&self, number: u64, now_ns: i64, stored: &dyn Fn(usize) -> bool) -> Result<bool, u32> {
        if self.queue.is_empty() {
            return Ok(true);
        }
        let updated = |index: usize| {
            let member = &self.queue[index];
            let Some(activation) = &member.activation else { return false };
            // SAFETY: activations of the writing source.
            let state = unsafe { &*activation.state() };
            state.due && stores_member(state, member.ratio) && stored(index)
        };
        let Some(first) = (0..self.queue.len()).find(|&index| updated(index)) else { return Ok(false) };
        // SAFETY: the caller is the one that touches it.
        let sender = unsafe { &mut *self.sender.get() };
        let masks = self.queue.len().div_ceil(64);
        let sent = sender.push(number, now_ns, &mut |row| {
            row[..masks * WORD].fill(0);
            for (index, member) in self.queue.iter().enumerate().filter(|(index, _)| updated(*index)) {
                row[index / 8] |= 1 << (index % 8);
                let update = member.activation.as_ref().map_or(0, |activation| {
                    // SAFETY: as above.
                    let state = unsafe { &*activation.state() };
                    update_number(state, member.ratio)
                });
                row[(masks + index) * WORD..][..WORD].copy_from_slice(&update.to_ne_bytes());
                // SAFETY: the cell is held.
                unsafe { row[member.offset..member.offset + member.cell.len()].as_mut_ptr().copy_from_nonoverlapping(member.cell.start(), member.cell.len()) };
            }
        });
        match sent {
            Ok(()) => Ok(sender.arrived()),
            Err(Full) => Err(first as u32),
        }
    }
}

fn stores_member(state: &crate::schedule::State, n: u32) -> bool {
    crate::schedule::stores(state.number - state.activated, n)
}

/// Which update of the member this one is, from 0 at activation.
fn update_number(state: &crate::schedule::State, n: u32) -> u64 {
    let phase = state.number - state.activated;
    phase / u64::from(n.max(1))
}

/// The reading end: latched once, at the start of the reader's firing.
pub struct Inbound {
    state: UnsafeCell<InboundState>,
    /// Release time of the publication that was latched last.
    brought_ns: AtomicI64,
    /// Since when a ratio value is absent, plus one; 0 where none is.
    late_ns: AtomicI64,
    spans: Vec<Span>,
    pub(crate) members: Vec<QueueMember>,
    pub(crate) way: Option<Way>,
    pub(crate) group: Vec<Cell>,
}

struct InboundState {
    receiver: Box<dyn Receiver>,
    waiting: Vec<Waiting>,
}

/// Values of one member that have arrived and were not taken yet: a ring of `DEPTH`.
struct Waiting {
    bytes: Box<[u8]>,
    numbers: [u64; DEPTH],
    first: usize,
    count: usize,
    /// Values taken so far: a reader has had one if it remembers this number.
    sequence: u64,
    /// Number of the value in the cell; of a ratio member.
    taken: Option<u64>,
    /// The ratio value that was found to be late last, so that it is counted once.
    late: Option<u64>,
    /// Of a ratio member: number of the newest value that arrived, since the reader was switched on.
    newest: Option<u64>,
    /// Of a ratio member n: (p, k) where invocation p of the reader, counted from its activation, takes number k, p + n number k + 1, ….
    anchor: (u64, u64),
    /// Of a ratio member: invocations of the reader since its activation, when it was looked at last.
    phase: u64,
    /// True while an activation that is on has not had the present value.
    held: bool,
}

/// Room for a member's values on the reader's side; more wait in the connection's own queue.
const DEPTH: usize = 4;

// SAFETY: touched only by the kernel of the reading source.
unsafe impl Send for Inbound {}
// SAFETY: as for `Send`.
unsafe impl Sync for Inbound {}

impl Inbound {
    /// `group` and `queue` as the writing end has them, with cells of the reader's image.
    pub fn new(receiver: impl Into<End<dyn Receiver>>, group: Vec<Cell>, queue: Vec<QueueMember>) -> Arc<Inbound> {
        let (spans, _) = spans(&group);
        let waiting = queue.iter().map(|member| Waiting::new(member.cell.len(), member.ratio)).collect();
        let End { end: receiver, way } = receiver.into();
        let state = UnsafeCell::new(InboundState { receiver, waiting });
        Arc::new(Inbound { state, brought_ns: AtomicI64::new(i64::MIN), late_ns: AtomicI64::new(0), spans, members: queue, way, group })
    }

    /// Release time of the firing whose publication was latched last, ns on the clock; none before the first.
    pub fn brought_ns(&self) -> Option<i64> {
        Some(self.brought_ns.load(Ordering::Relaxed)).filter(|ns| *ns != i64::MIN)
    }

    /// Since when a ratio value is absent that its reader has asked for, ns on the clock.
    pub fn late_since_ns(&self) -> Option<i64> {
        Some(self.late_ns.load(Ordering::Relaxed) - 1).filter(|ns| *ns >= 0)
    }

    /// What `brought_ns` and `late_since_ns` say, of one that lies elsewhere: as its kernel told last.
    pub fn report(&self, brought_ns: Option<i64>, late_since_ns: Option<i64>) {
        self.brought_ns.store(brought_ns.unwrap_or(i64::MIN), Ordering::Relaxed);
        self.late_ns.store(late_since_ns.map_or(0, |ns| ns + 1), Ordering::Relaxed);
    }

    /// Takes the newest group into its cells, if there is a new one. `midway` is called with half of it copied.
    ///
    /// # Safety
    /// Called by the kernel of the reading source alone.
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

    /// The same in one go: the path of real threads.
    ///
    /// # Safety
    /// As for `latch`.
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

    /// True where it has queue members.
    pub(crate) fn queues(&self) -> bool {
        !self.members.is_empty()
    }

    /// Forgets which members are held.
    ///
    /// # Safety
    /// As for `latch`.
    pub(crate) unsafe fn release(&self) {
        // SAFETY: the caller is the one that touches it.
        unsafe { &mut *self.state.get() }.waiting.iter_mut().for_each(|waiting| waiting.held = false);
    }

    /// Marks a member whose value an active reader has not had.
    ///
    /// # Safety
    /// As for `latch`.
    pub(crate) unsafe fn hold(&self, member: usize, had: u64) {
        // SAFETY: the caller is the one that touches it.
        let waiting = &mut unsafe { &mut *self.state.get() }.waiting[member];
        waiting.held |= waiting.sequence != had;
    }

    /// Takes the rows that arrived, and the next value of each synchronous member that is not held.
    ///
    /// # Safety
    /// As for `latch`.
    pub(crate) unsafe fn take(&self) {
        // SAFETY: the caller is the one that touches it.
        let state = unsafe { &mut *self.state.get() };
        self.distribute(state);
        for (member, waiting) in self.members.iter().zip(&mut state.waiting).filter(|(member, _)| member.ratio == 0) {
            if !waiting.held {
                waiting.pop_into(&member.cell);
            }
        }
    }

    /// Takes ratio members by number for the readers that are due: invocation j takes number ⌊j/n⌋ − 1, where both began together; where one
    /// began later, the first number that came is taken from the next invocation on, and the next one n later. `late` is called with
    /// each member whose value is absent.
    ///
    /// # Safety
    /// As for `latch`.
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
            let wanted = number + (phase - first) / u64::from(member.ratio);
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

    /// How many values of `member` were taken so far.
    ///
    /// # Safety
    /// As for `latch`.
    #[inline]
    pub(crate) unsafe fn sequence(&self, member: usize) -> u64 {
        // SAFETY: the caller is the one that touches it.
        unsafe { &*self.state.get() }.waiting[member].sequence
    }

    /// Drops what waits for `member`: a reader that is switched on takes nothing that came before. Gives its sequence.
    ///
    /// # Safety
    /// As for `latch`.
    pub(crate) unsafe fn skip(&self, member: usize) -> u64 {
        // SAFETY: the caller is the one that touches it.
        let state = unsafe { &mut *self.state.get() };
        loop {
            state.waiting[member].count = 0;
            let before = state.receiver.rows();
            if before == 0 {
                break;
            }
            self.distribute(state);
            if state.receiver.rows() >= before {
                break;
            }
        }
        let waiting = &mut state.waiting[member];
        waiting.count = 0;
        waiting.begin(self.members[member].ratio);
        waiting.sequence
    }

    /// False for a ratio member whose reader is off: nothing waits for it.
    fn is_read(&self, index: usize) -> bool {
        let member = &self.members[index];
        // SAFETY: an activation of the reading source, whose kernel asks.
        member.ratio == 0 || member.activation.as_ref().is_none_or(|activation| unsafe { (*activation.state()).on })
    }

    /// Moves rows that arrived to their members, while all members of a row have room.
    fn distribute(&self, state: &mut InboundState) {
        let masks = self.members.len().div_ceil(64);
        while let Some((_, row)) = state.receiver.peek_row() {
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

impl Waiting {
    fn new(len: usize, ratio: u32) -> Waiting {
        Waiting {
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

    /// Looks at the reader: invocations since its activation. Where it was switched on since the last look, all begins anew.
    #[inline]
    fn attend(&mut self, reader: &crate::schedule::State, ratio: u32) -> u64 {
        let phase = reader.number.saturating_sub(reader.activated);
        if phase < self.phase {
            self.begin(ratio);
        }
        self.phase = phase;
        phase
    }

    /// The reader is switched on.
    #[cold]
    fn begin(&mut self, ratio: u32) {
        (self.taken, self.late, self.newest, self.anchor) = (None, None, None, (u64::from(ratio), 0));
    }

    /// Number `number` of a ratio member arrives. The first one since the reader or the writer was switched on says how their
    /// invocations lie to each other: as if they had begun together, unless that is off by more than one update.
    #[inline]
    fn relate(&mut self, number: u64, reader: &crate::schedule::State, ratio: u32) {
        if !reader.on {
            // Nothing waits for it.
            self.count = 0;
            return;
        }
        let (phase, n) = (self.attend(reader, ratio), u64::from(ratio));
        let begins = self.newest.is_none_or(|newest| number <= newest);
        self.newest = Some(number);
        if begins {
            let together = phase.abs_diff((number + 1) * n) <= n;
            self.anchor = if together { (n, 0) } else { (phase + 1, number) };
            (self.count, self.taken, self.late) = (0, None, None);
        }
    }

    fn push(&mut self, number: u64, bytes: &[u8]) {
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

/// The writing end of a ring of rows, used by one source at a time.
pub struct RowsEnd(pub(crate) UnsafeCell<interconnect::RowsWriter>);

// SAFETY: used by the kernel of one source at a time.
unsafe impl Send for RowsEnd {}
// SAFETY: as for `Send`.
unsafe impl Sync for RowsEnd {}

impl RowsEnd {
    /// Takes the writing end that `interconnect::rows` made.
    pub fn new(writer: interconnect::RowsWriter) -> Arc<RowsEnd> {
        Arc::new(RowsEnd(UnsafeCell::new(writer)))
    }

    /// Bytes of a row, and rows that the ring holds.
    pub fn shape(&self) -> (usize, usize) {
        // SAFETY: neither ever changes.
        let writer = unsafe { &*self.0.get() };
        (writer.row_len(), writer.depth())
    }

    /// A reader of the ring.
    pub fn reader(&self) -> interconnect::RowsReader {
        // SAFETY: the shared part of a writer never changes.
        unsafe { &*self.0.get() }.reader()
    }

    /// Writes a row that a kernel elsewhere wrote there, `lost` rows after the one before. By the one thread that takes what comes from
    /// there. Nothing where it is of another length.
    pub fn repeat(&self, lost: u64, number: u64, time_ns: i64, bytes: &[u8]) {
        // SAFETY: the caller is the one that touches it: the ring's source has no kernel here.
        let writer = unsafe { &mut *self.0.get() };
        writer.skip(lost.min(u64::from(u32::MAX)));
        if bytes.len() == writer.row_len() {
            writer.write(number, time_ns, |sink| sink.put(bytes));
        }
    }

    /// Writes one row of `spans`.
    ///
    /// # Safety
    /// Called by the kernel of its source alone.
    #[inline]
    pub(crate) unsafe fn write(&self, number: u64, now_ns: i64, spans: &[Span]) {
        // SAFETY: the caller is the one that touches it.
        let writer = unsafe { &mut *self.0.get() };
        writer.write(number, now_ns, |sink| {
            for span in spans {
                // SAFETY: a span lies within its cells, which the table holds.
                sink.put(unsafe { std::slice::from_raw_parts(span.start, span.len) });
            }
        });
    }
}
