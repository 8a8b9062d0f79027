// SPDX-License-Identifier: Apache-2.0
//! Connections between interrupt sources, as the kernel sees them: the cells that a publication reads and the cells that a latch fills.
//!
//! A row of a queue starts with [`row_prefix`] bytes: one bit for each member, set if the row contains it, then the update number of each
//! member. The members' values follow at `QueueMember::offset`.
use crate::connection_identity::{Nowhere, Way};
use crate::memory::{Cell, Span, spans};
use crate::phase::{CountedInvocations, State, stores};
use crate::source::SourceId;
use interconnect::{Full, Sender};
use std::cell::UnsafeCell;
use std::sync::Arc;

/// A member of a connection's queue.
pub struct QueueMember<A> {
    /// Cell in the image of the writer (outbound) or of the reader (inbound).
    pub cell: Cell,
    /// Offset of the member in a row; at least [`row_prefix`] for the connection's number of members.
    pub offset: usize,
    /// Outbound: the writer's activation; a row contains the member if the activation was due in that firing and did not fault. Inbound,
    /// for a ratio input: the reader's activation, whose invocations select the row.
    pub activation: Option<Arc<A>>,
    /// Inbound: 0 for a synchronous member, n for a ratio input n (taken by number). Outbound: n if the writer's output is a ratio output
    /// n, else 0.
    pub ratio: u32,
}

/// Returns the size of the kernel's prefix in a row of `members` members, in bytes.
pub fn row_prefix(members: usize) -> usize {
    WORD * (members.div_ceil(64) + members)
}

pub(crate) const WORD: usize = 8;

/// End of a connection, with the connection's identity if the other end may be remote.
pub struct End<T: ?Sized> {
    /// The end itself.
    pub end: Box<T>,
    /// Identity of the connection; `None` if both ends were created together.
    pub way: Option<Way>,
}

impl<T: ?Sized> From<Box<T>> for End<T> {
    fn from(end: Box<T>) -> Self {
        End { end, way: None }
    }
}

/// The writing end: publishes the group once per firing, and sends a row if a queue member was updated. After publishing, it raises
/// `wake` (a software source), if set.
pub struct Outbound<A> {
    sender: UnsafeCell<Box<dyn Sender>>,
    spans: Vec<Span>,
    group_len: usize,
    pub queue: Vec<QueueMember<A>>,
    pub wake: Option<SourceId>,
    pub way: Option<Way>,
    pub group: Vec<Cell>,
}

// SAFETY: the sender and the cells are touched only by the kernel of the writing source.
unsafe impl<A: Send + Sync> Send for Outbound<A> {}
// SAFETY: as for `Send`.
unsafe impl<A: Send + Sync> Sync for Outbound<A> {}

impl<A: CountedInvocations> Outbound<A> {
    /// Creates the outbound side. `group`: the asynchronous members, in their order in the group. `wake` is raised once in each firing in
    /// which a row was sent, or in each firing if the connection has no queue.
    pub fn new(sender: impl Into<End<dyn Sender>>, group: Vec<Cell>, queue: Vec<QueueMember<A>>, wake: Option<SourceId>) -> Arc<Outbound<A>> {
        let (spans, group_len) = spans(&group);
        let End { end, way } = sender.into();
        Arc::new(Outbound { sender: UnsafeCell::new(end), spans, group_len, queue, wake, way, group })
    }

    /// Drops the connection's carrier and its descriptors; nothing is sent afterwards.
    ///
    /// # Safety
    /// The kernel of the writing source must have ended.
    pub unsafe fn sever(&self) {
        // SAFETY: nobody else touches it any more.
        unsafe { *self.sender.get() = Box::new(Nowhere::default()) };
    }

    /// Publishes the group. Calls `midway` when half of it has been copied.
    ///
    /// # Safety
    /// Must be called only by the kernel of the writing source.
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

    /// Publishes the group without preemption points; used by real threads.
    ///
    /// # Safety
    /// Same as for `publish`.
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

    /// Sends a row with the members that were updated in this firing; `stored(m)` is true if the step that writes member m succeeded.
    /// Returns true if the reader must be raised; if the row was lost, fails with its first member.
    ///
    /// # Safety
    /// Same as for `publish`.
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

fn stores_member(state: &State, n: u32) -> bool {
    stores(state.number - state.activated, n)
}

/// Returns the number of the member's current update, counted from 0 at activation.
fn update_number(state: &State, n: u32) -> u64 {
    let phase = state.number - state.activated;
    phase / u64::from(n.max(1))
}
