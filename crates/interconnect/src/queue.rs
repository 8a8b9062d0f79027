// SPDX-License-Identifier: Apache-2.0
//! The queue: carries every row, in order and exactly once, from one writer to one reader.
//!
//! | | writer | reader |
//! |---|---|---|
//! | may block the other | never; a full queue refuses the push | never; an empty queue has no row |
//! | steps | one atomic store; one load if the cached count indicates full | one store per pop; one load if the cached count indicates empty |
//! | if the other is preempted, stopped or killed at any point | continues until full | continues until empty |
//!
//! All `depth` rows are allocated at construction: a deeper queue would only hide a reader that does not keep up. Each count is written
//! by one end only and has a cache line of its own, as does each end with its copy of the other's count. The algorithm does not depend on
//! the location of counts and rows: see [`QueueMemory`].
use crate::aligned::AlignedBytes;
use crate::carrier::Full;
use crate::sync::{Arc, AtomicUsize, Ordering, OwnLine, UnsafeCell};

/// Creates a queue of `depth` rows of `row_len` bytes. Panics if `depth` is 0.
pub fn queue(row_len: usize, depth: usize) -> (QueueWriter, QueueReader) {
    assert!(depth > 0, "a queue needs room for one row or more");
    let slots = (0..depth).map(|_| UnsafeCell::new(Slot { number: 0, row: AlignedBytes::new(row_len) })).collect();
    let memory = OwnQueue(Arc::new(HeapMemory { popped: OwnLine(AtomicUsize::new(0)), pushed: OwnLine(AtomicUsize::new(0)), slots }));
    let writer = QueueWriter { memory: memory.clone(), pushed: 0, next: 0, popped_seen: 0 };
    (writer, QueueReader { memory, popped: 0, next: 0, pushed_seen: 0 })
}

/// Memory of the counts and rows of a queue: in this process ([`queue`]), or shared with other processes.
///
/// # Safety
/// Counts and rows must not move as long as the value lives; no two rows may overlap; the depth must be constant and not 0; and only one writer and one reader at a time, in any process, may access them.
pub unsafe trait QueueMemory {
    /// Returns the number of rows popped so far (wraps around); written by the reader.
    fn popped(&self) -> &AtomicUsize;

    /// Returns the number of rows pushed so far (wraps around); written by the writer.
    fn pushed(&self) -> &AtomicUsize;

    /// Returns the capacity in rows.
    fn depth(&self) -> usize;

    /// Returns the number and bytes of the row in `slot`, which is below the depth, for the end that may access it.
    fn for_reading(&self, slot: usize) -> (*const u64, *const [u8]);

    /// Returns the same as [`for_reading`](Self::for_reading), for writing.
    fn for_writing(&self, slot: usize) -> (*mut u64, *mut [u8]);

    /// Returns the reader's count, which is 0 to `depth` behind `pushed`, the writer's count. Implementations whose counts can be written
    /// by other processes check them here; between two threads, the check costs nothing.
    #[inline]
    fn popped_of(&self, _pushed: usize) -> usize {
        self.popped().load(Ordering::Acquire)
    }

    /// Returns the writer's count, which is 0 to `depth` ahead of `popped`, the reader's count.
    #[inline]
    fn pushed_of(&self, _popped: usize) -> usize {
        self.pushed().load(Ordering::Acquire)
    }
}

/// Writing end of a queue.
#[repr(align(64))]
pub struct QueueWriter<M = OwnQueue> {
    memory: M,
    /// Number of rows pushed so far (wraps around).
    pushed: usize,
    /// Slot of the next row.
    next: usize,
    /// Reader's count as last read.
    popped_seen: usize,
}

impl<M: QueueMemory> QueueWriter<M> {
    /// Creates the writing end of a queue in `memory`, positioned after the rows that wait there.
    ///
    /// # Safety
    /// No other writer of the queue may exist, and the counts must be those left by the previous ends.
    pub unsafe fn in_memory(memory: M) -> Self {
        let pushed = memory.pushed().load(Ordering::Acquire);
        let popped_seen = memory.popped_of(pushed);
        QueueWriter { next: pushed % memory.depth(), memory, pushed, popped_seen }
    }

    /// Appends a row: `fill` writes its bytes, which initially contain an earlier row. Returns [`Full`] without calling `fill` if `depth`
    /// rows wait. If `fill` panics, nothing is appended. Real-time safe.
    #[inline]
    pub fn push(&mut self, number: u64, fill: impl FnOnce(&mut [u8])) -> Result<(), Full> {
        let depth = self.memory.depth();
        if self.pushed.wrapping_sub(self.popped_seen) == depth {
            self.popped_seen = self.memory.popped_of(self.pushed);
            if self.pushed.wrapping_sub(self.popped_seen) == depth {
                return Err(Full);
            }
        }
        let (numbered, row) = self.memory.for_writing(self.next);
        // SAFETY: fewer than `depth` rows wait, so the slot `next` is not among those that the reader may touch: it has
        // popped the row that was here (acquired above) and sees the new one only after the store below.
        let (numbered, row) = unsafe { (&mut *numbered, &mut *row) };
        *numbered = number;
        fill(row);
        self.pushed = self.pushed.wrapping_add(1);
        self.next = following(self.next, depth);
        self.memory.pushed().store(self.pushed, Ordering::Release);
        Ok(())
    }

    /// Returns the number of waiting rows; the reader may pop rows at any time.
    pub fn len(&self) -> usize {
        self.pushed.wrapping_sub(self.memory.popped_of(self.pushed))
    }

    /// Returns true if no row waits.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Reading end of a queue.
#[repr(align(64))]
pub struct QueueReader<M = OwnQueue> {
    memory: M,
    /// Number of rows popped so far (wraps around).
    popped: usize,
    /// Slot of the oldest row.
    next: usize,
    /// Writer's count as last read.
    pushed_seen: usize,
}

impl<M: QueueMemory> QueueReader<M> {
    /// Creates the reading end of a queue in `memory`, starting with the rows that wait there.
    ///
    /// # Safety
    /// No other reader of the queue may exist, and the counts must be those left by the previous ends.
    pub unsafe fn in_memory(memory: M) -> Self {
        let popped = memory.popped().load(Ordering::Acquire);
        let pushed_seen = memory.pushed_of(popped);
        QueueReader { next: popped % memory.depth(), memory, popped, pushed_seen }
    }

    /// Returns the number and bytes of the oldest row without removing it; `None` if no row waits. Real-time safe.
    #[inline]
    pub fn peek(&mut self) -> Option<(u64, &[u8])> {
        if !self.waits() {
            return None;
        }
        let (number, row) = self.memory.for_reading(self.next);
        // SAFETY: the row is pushed (acquired in `waits`) and not popped, so the writer does not touch it; popping needs
        // `&mut self` and so ends this borrow.
        Some(unsafe { (*number, &*row) })
    }

    /// Removes the oldest row; returns false if no row waits. Real-time safe.
    #[inline]
    pub fn pop(&mut self) -> bool {
        if !self.waits() {
            return false;
        }
        self.popped = self.popped.wrapping_add(1);
        self.next = following(self.next, self.memory.depth());
        self.memory.popped().store(self.popped, Ordering::Release);
        true
    }

    /// Returns the number of waiting rows; the writer may push more at any time.
    pub fn len(&self) -> usize {
        self.memory.pushed_of(self.popped).wrapping_sub(self.popped)
    }

    /// Returns true if no row waits.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline]
    fn waits(&mut self) -> bool {
        if self.pushed_seen == self.popped {
            self.pushed_seen = self.memory.pushed_of(self.popped);
        }
        self.pushed_seen != self.popped
    }
}

/// Memory of this process, shared by both ends.
#[derive(Clone)]
pub struct OwnQueue(Arc<HeapMemory>);

// SAFETY: counts and rows are behind one `Arc`, each row is an allocation of its own, `queue` refuses a depth of 0 and makes one end of each kind.
unsafe impl QueueMemory for OwnQueue {
    #[inline]
    fn popped(&self) -> &AtomicUsize {
        &self.0.popped.0
    }

    #[inline]
    fn pushed(&self) -> &AtomicUsize {
        &self.0.pushed.0
    }

    #[inline]
    fn depth(&self) -> usize {
        self.0.slots.len()
    }

    #[inline]
    fn for_reading(&self, slot: usize) -> (*const u64, *const [u8]) {
        // SAFETY: the caller's end may touch the slot, so nobody has a reference for writing to it.
        self.0.slots[slot].with(|slot| unsafe { (&raw const (*slot).number, std::ptr::from_ref((*slot).row.bytes())) })
    }

    #[inline]
    fn for_writing(&self, slot: usize) -> (*mut u64, *mut [u8]) {
        // SAFETY: the caller's end may touch the slot, so nobody else has a reference to it.
        self.0.slots[slot].with_mut(|slot| unsafe { (&raw mut (*slot).number, std::ptr::from_mut((*slot).row.bytes_mut())) })
    }
}

struct Slot {
    number: u64,
    row: AlignedBytes,
}

struct HeapMemory {
    /// Count written by the reader.
    popped: OwnLine<AtomicUsize>,
    /// Count written by the writer.
    pushed: OwnLine<AtomicUsize>,
    slots: Box<[UnsafeCell<Slot>]>,
}

// SAFETY: the slots are reached only through the two ends, of which there is one each, neither `Clone`; which end may touch
// which slot follows from the two counts, each stored with release by one end and loaded with acquire by the other.
unsafe impl Sync for HeapMemory {}
// SAFETY: it owns numbers and bytes only.
unsafe impl Send for HeapMemory {}

/// Returns the slot after `slot`, without a division.
#[inline]
fn following(slot: usize, depth: usize) -> usize {
    if slot + 1 == depth { 0 } else { slot + 1 }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn rows_come_in_order_with_their_numbers() {
        let (mut writer, mut reader) = queue(2, 3);
        for number in 10..13 {
            writer.push(number, |row| row.fill(number as u8)).expect("there is room for three");
        }
        assert_eq!((writer.len(), reader.len()), (3, 3));
        for number in 10..13 {
            assert_eq!(reader.peek(), Some((number, [number as u8; 2].as_slice())));
            assert_eq!(reader.peek(), Some((number, [number as u8; 2].as_slice())), "a look takes nothing");
            assert!(reader.pop());
        }
        assert_eq!(reader.peek(), None);
        assert!(!reader.pop());
        assert!(writer.is_empty() && reader.is_empty());
    }

    #[test]
    fn a_full_queue_refuses_without_filling() {
        let (mut writer, mut reader) = queue(1, 1);
        assert_eq!(writer.push(0, |row| row[0] = 1), Ok(()));
        assert_eq!(writer.push(1, |_| panic!("filled a row that there is no room for")), Err(Full));
        assert_eq!(reader.peek(), Some((0, [1].as_slice())));
        assert!(reader.pop());
        assert_eq!(writer.push(2, |row| row[0] = 3), Ok(()));
        assert_eq!(reader.peek(), Some((2, [3].as_slice())));
    }

    #[test]
    fn a_fill_that_panics_appends_nothing() {
        let (mut writer, mut reader) = queue(1, 2);
        let push = std::panic::AssertUnwindSafe(|| writer.push(0, |_| panic!("the writer faults here")));
        assert!(std::panic::catch_unwind(push).is_err());
        assert_eq!(reader.peek(), None);
        assert_eq!(writer.push(1, |row| row[0] = 9), Ok(()));
        assert_eq!(reader.peek(), Some((1, [9].as_slice())));
    }
}
