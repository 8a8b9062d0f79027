// SPDX-License-Identifier: Apache-2.0
//! The triple buffer: carries the newest group of bytes from one writer to one reader, never torn.
//!
//! | | writer | reader |
//! |---|---|---|
//! | may block the other | never | never |
//! | steps of an exchange | one swap | one load if there is no new group, else one load and one swap |
//! | retries | none | none |
//! | if the other is preempted, stopped or killed at any point | continues | continues with the last complete publication |
//!
//! Why three buffers: the writer fills one (*back*), the reader reads one (*front*), and the third (*middle*) holds the newest complete
//! publication, so that either side can always exchange its own buffer for it without coordination. With two, one side would have to wait
//! for the other or overwrite a buffer that is being read; a fourth would never be used. The middle word contains the index of the middle
//! buffer, and a flag that indicates whether the reader has seen it. Each swap moves a whole buffer, so a group is never torn.
//!
//! Each buffer, and the word, has its own cache lines. The algorithm does not depend on their location: see [`TripleMemory`].
use crate::aligned::AlignedBytes;
use crate::sync::{Arc, AtomicU8, Ordering, OwnLine, UnsafeCell};

/// Creates a triple buffer for groups of `len_bytes` bytes, which is zero until the first publication.
pub fn triple_buffer(len_bytes: usize) -> (TripleWriter, TripleReader) {
    let buffers = std::array::from_fn(|_| UnsafeCell::new(AlignedBytes::new(len_bytes)));
    let memory = OwnTriple(Arc::new(HeapMemory { middle: OwnLine(AtomicU8::new(MIDDLE_AT_FIRST)), buffers }));
    (TripleWriter { memory: memory.clone(), back: BACK_AT_FIRST }, TripleReader { memory, front: FRONT_AT_FIRST })
}

/// Buffer of the writer before the first exchange.
pub const BACK_AT_FIRST: u8 = 0;
/// Buffer in the middle before the first exchange; also the initial middle word.
pub const MIDDLE_AT_FIRST: u8 = 1;
/// Buffer of the reader before the first exchange.
pub const FRONT_AT_FIRST: u8 = 2;

/// Returns the index of the buffer in the middle, contained in `word`, the middle word.
pub fn in_the_middle(word: u8) -> u8 {
    word & INDEX
}

/// Returns true if `word` indicates a publication that the reader has not yet seen.
pub fn is_news(word: u8) -> bool {
    word & NEWS != 0
}

/// Memory of the middle word and the three buffers of a triple buffer: in this process ([`triple_buffer`]), or shared with other
/// processes.
///
/// # Safety
/// The word and the buffers must not move as long as the value lives; the three buffers must not overlap; and only one writer and one reader at a time, in any process, may access them.
pub unsafe trait TripleMemory {
    /// Returns the middle word.
    fn middle(&self) -> &AtomicU8;

    /// Returns the buffer with this index (below 3), for the end that holds it.
    fn for_reading(&self, index: u8) -> *const [u8];

    /// Returns the same as [`for_reading`](Self::for_reading), for writing.
    fn for_writing(&self, index: u8) -> *mut [u8];

    /// Returns the index (below 3) of the buffer that an end receives in exchange for its own. The index is taken from `word`, the
    /// previous middle word. Implementations whose word can be written by other processes check it here; between two threads, the check
    /// costs nothing.
    #[inline]
    fn given(&self, word: u8, _own: u8) -> u8 {
        in_the_middle(word)
    }
}

/// Returns true if `word` is a valid middle word while an end holds the buffer `own`.
#[inline]
pub fn is_possible(word: u8, own: u8) -> bool {
    word <= (INDEX | NEWS) && in_the_middle(word) != INDEX && in_the_middle(word) != own
}

/// Writing end of a triple buffer.
pub struct TripleWriter<M = OwnTriple> {
    memory: M,
    /// Buffer that only this end accesses.
    back: u8,
}

impl<M: TripleMemory> TripleWriter<M> {
    /// Creates the writing end of a triple buffer in `memory`.
    ///
    /// # Safety
    /// No other writer of the buffer may exist, and `back` must be the buffer that is neither in the middle nor the reader's.
    pub unsafe fn in_memory(memory: M, back: u8) -> Self {
        TripleWriter { memory, back }
    }

    /// Returns the index of this end's buffer.
    #[inline]
    pub fn index(&self) -> u8 {
        self.back
    }

    /// Returns the buffer of the next publication, which starts on a cache line. It contains an earlier group, so all of it must be
    /// overwritten each time. Real-time safe.
    #[inline]
    pub fn back(&mut self) -> &mut [u8] {
        // SAFETY: `back`, `front` and the middle always name three different buffers (they start different and are only
        // ever exchanged by atomic swaps), so no other reference to this one exists; acquire-release on the swap orders
        // the reader's last use before this one. The borrow of `self` ends it before the next `publish`.
        unsafe { &mut *self.memory.for_writing(self.back) }
    }

    /// Publishes the back buffer, which the reader receives as a whole at its next latch. Takes one atomic swap. Real-time safe.
    #[inline]
    pub fn publish(&mut self) {
        let word = self.memory.middle().swap(self.back | NEWS, Ordering::AcqRel);
        self.back = self.memory.given(word, self.back);
    }
}

/// Reading end of a triple buffer.
pub struct TripleReader<M = OwnTriple> {
    memory: M,
    /// Buffer that only this end accesses.
    front: u8,
}

impl<M: TripleMemory> TripleReader<M> {
    /// Creates the reading end of a triple buffer in `memory`.
    ///
    /// # Safety
    /// No other reader of the buffer may exist, and `front` must be the buffer that is neither in the middle nor the writer's.
    pub unsafe fn in_memory(memory: M, front: u8) -> Self {
        TripleReader { memory, front }
    }

    /// Returns the index of this end's buffer.
    #[inline]
    pub fn index(&self) -> u8 {
        self.front
    }

    /// Takes the newest publication. Returns true if it is new to this reader; [`front`](Self::front) then returns it. Real-time safe.
    #[inline]
    pub fn latch(&mut self) -> bool {
        let middle = self.memory.middle();
        if middle.load(Ordering::Relaxed) & NEWS == 0 {
            return false;
        }
        // Only this end clears the mark, so the buffer received is a new one.
        let word = middle.swap(self.front, Ordering::AcqRel);
        self.front = self.memory.given(word, self.front);
        true
    }

    /// Returns the publication latched last; zeros before the first. Real-time safe.
    #[inline]
    pub fn front(&self) -> &[u8] {
        // SAFETY: as in `TripleWriter::back`: the writer cannot get at this buffer until the next `latch`, which needs
        // `&mut self` and so ends this borrow.
        unsafe { &*self.memory.for_reading(self.front) }
    }
}

/// Memory of this process, shared by both ends.
#[derive(Clone)]
pub struct OwnTriple(Arc<HeapMemory>);

// SAFETY: the word and the buffers are behind one `Arc`, the buffers are allocations of their own, and `triple_buffer` makes one end of each kind.
unsafe impl TripleMemory for OwnTriple {
    #[inline]
    fn middle(&self) -> &AtomicU8 {
        &self.0.middle.0
    }

    #[inline]
    fn for_reading(&self, index: u8) -> *const [u8] {
        // SAFETY: the caller's end holds the buffer, so nobody has a reference for writing to it.
        self.0.buffers[index as usize].with(|buffer| unsafe { std::ptr::from_ref((*buffer).bytes()) })
    }

    #[inline]
    fn for_writing(&self, index: u8) -> *mut [u8] {
        // SAFETY: the caller's end holds the buffer, so nobody else has a reference to it.
        self.0.buffers[index as usize].with_mut(|buffer| unsafe { std::ptr::from_mut((*buffer).bytes_mut()) })
    }
}

struct HeapMemory {
    /// Index of the buffer in the middle, combined with [`NEWS`] if the reader has not yet seen it.
    middle: OwnLine<AtomicU8>,
    buffers: [UnsafeCell<AlignedBytes>; 3],
}

const INDEX: u8 = 0b011;
const NEWS: u8 = 0b100;

// SAFETY: the cells are reached only through the two ends, of which there is one each, neither `Clone`; which end may touch
// which cell is exchanged by acquire-release swaps on `middle`.
unsafe impl Sync for HeapMemory {}
// SAFETY: it owns bytes only.
unsafe impl Send for HeapMemory {}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_news_before_the_first_publication() {
        let (_writer, mut reader) = triple_buffer(4);
        assert!(!reader.latch());
        assert_eq!(reader.front(), [0; 4]);
    }

    #[test]
    fn the_newest_publication_is_latched_once() {
        let (mut writer, mut reader) = triple_buffer(1);
        for value in 1..=5 {
            writer.back()[0] = value;
            writer.publish();
        }
        assert!(reader.latch());
        assert_eq!(reader.front(), [5]);
        assert!(!reader.latch());
        assert_eq!(reader.front(), [5]);
    }

    #[test]
    fn a_latched_group_stays_while_the_writer_goes_on() {
        let (mut writer, mut reader) = triple_buffer(1);
        writer.back()[0] = 1;
        writer.publish();
        assert!(reader.latch());
        for value in 2..=9 {
            writer.back()[0] = value;
            writer.publish();
            assert_eq!(reader.front(), [1]);
        }
        assert!(reader.latch());
        assert_eq!(reader.front(), [9]);
    }

    #[test]
    fn a_writer_that_ends_inside_a_group_leaves_its_last_complete_one() {
        let (mut writer, mut reader) = triple_buffer(2);
        writer.back().fill(7);
        writer.publish();
        writer.back()[0] = 8;
        drop(writer);
        assert!(reader.latch());
        assert_eq!(reader.front(), [7, 7]);
        assert!(!reader.latch());
    }

    #[test]
    fn buffers_start_on_cache_lines() {
        let (mut writer, reader) = triple_buffer(24);
        for _ in 0..3 {
            assert_eq!(writer.back().as_ptr().addr() % 64, 0);
            writer.publish();
        }
        assert_eq!(reader.front().as_ptr().addr() % 64, 0);
    }
}
