// SPDX-License-Identifier: Apache-2.0
//! Layout of the memory of one connection: words, three buffers of the group, the rows of the queue. Words written by different ends are
//! on different cache lines. The process of the other end may overwrite any of it at any time: each word is checked as it is read, and
//! the first impossible value ends the connection (`fate`).
//!
//! | line | word | written by |
//! |---|---|---|
//! | 0 | initialised mark, and the lengths | the end that creates it |
//! | 1 | index of the middle buffer | both, by swaps |
//! | 2 | index of the writer's buffer | the writer, after each exchange |
//! | 3 | index of the reader's buffer | the reader, after each exchange |
//! | 4 | rows pushed | the writer |
//! | 5 | rows popped | the reader |
//! | 6 | bell of the reader's process | the reader, when it is created and dropped |
use crate::fate::{Fate, Word};
use crate::sealed::{LINE, SealedMemory};
use interconnect::triple::{TripleMemory, in_the_middle, is_possible};
use interconnect::{ConnectionSpec, Header, QueueMemory};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU32, AtomicU64, AtomicUsize, Ordering};

const LINES_OF_WORDS: usize = 7;
const BUFFERS: usize = 3;
/// Size of the number after a row, in bytes.
const NUMBER_LEN: usize = size_of::<u64>();

/// Memory of one connection, as seen by one end.
#[derive(Clone)]
pub(crate) struct Layout {
    memory: Arc<SealedMemory>,
    fate: Arc<Fate>,
    buffer_len: usize,
    row_len: usize,
    depth: usize,
}

/// Returns the number of bytes that a connection needs.
pub(crate) fn len_of(spec: &ConnectionSpec) -> usize {
    LINES_OF_WORDS * LINE + BUFFERS * lines(buffer_len(spec.asynchronous_len)) + spec.queue_depth * slot_len(spec.queue_row_len)
}

fn lines(len: usize) -> usize {
    len.next_multiple_of(LINE)
}

/// Returns the size of a group, its header, and the byte that marks it as published.
fn buffer_len(group_len: usize) -> usize {
    published_at(group_len) + 1
}

/// Returns the offset of the byte that marks a buffer as published.
pub(crate) fn published_at(group_len: usize) -> usize {
    Header::behind(group_len) + Header::LEN
}

fn number_at(row_len: usize) -> usize {
    row_len.next_multiple_of(NUMBER_LEN)
}

fn slot_len(row_len: usize) -> usize {
    lines(number_at(row_len) + NUMBER_LEN)
}

/// Header that an end verifies before it uses the memory.
pub(crate) struct RegionHeader {
    /// [`MADE`] once everything else is initialised.
    pub mark: AtomicU64,
    pub run: AtomicU64,
    pub number: AtomicU64,
    asynchronous_len: AtomicU64,
    queue_row_len: AtomicU64,
    queue_depth: AtomicU64,
}

impl RegionHeader {
    /// Returns the lengths for which the memory was created.
    pub fn lengths(&self) -> [u64; 3] {
        [&self.asynchronous_len, &self.queue_row_len, &self.queue_depth].map(|len| len.load(Ordering::Relaxed))
    }

    /// Stores the run, connection and lengths for which the memory was created; called last.
    pub fn set(&self, run: u64, number: u64, [asynchronous_len, queue_row_len, queue_depth]: [u64; 3]) {
        self.run.store(run, Ordering::Relaxed);
        self.number.store(number, Ordering::Relaxed);
        self.asynchronous_len.store(asynchronous_len, Ordering::Relaxed);
        self.queue_row_len.store(queue_row_len, Ordering::Relaxed);
        self.queue_depth.store(queue_depth, Ordering::Relaxed);
        self.mark.store(MADE, Ordering::Release);
    }
}

/// Mark of initialised memory; changed whenever the layout changes.
pub(crate) const MADE: u64 = 0x6f70_656e_6770_0002;

impl Layout {
    /// Wraps `memory`, which must have [`len_of`] bytes.
    pub fn new(memory: Arc<SealedMemory>, fate: Arc<Fate>, spec: &ConnectionSpec) -> Self {
        Layout { memory, fate, buffer_len: buffer_len(spec.asynchronous_len), row_len: spec.queue_row_len, depth: spec.queue_depth }
    }

    /// Returns the memory itself.
    pub fn memory(&self) -> &SealedMemory {
        &self.memory
    }

    /// Returns true if the connection is lost.
    #[inline]
    pub fn is_lost(&self) -> bool {
        self.fate.is_lost()
    }

    pub fn made(&self) -> &RegionHeader {
        Layout::made_in(&self.memory)
    }

    /// Returns the header in the first line of the memory.
    pub fn made_in(memory: &SealedMemory) -> &RegionHeader {
        // SAFETY: as in `word`.
        unsafe { memory.at(0).cast().as_ref() }
    }

    pub fn back(&self) -> &AtomicU8 {
        self.word(2)
    }

    pub fn front(&self) -> &AtomicU8 {
        self.word(3)
    }

    pub fn bell(&self) -> &AtomicU32 {
        self.word(6)
    }

    /// Returns the word at the start of a line.
    fn word<T>(&self, line: usize) -> &T {
        const { assert!(size_of::<T>() <= LINE && align_of::<T>() <= LINE) };
        // SAFETY: lines are aligned and inside the mapping, which lives as long as `self`; `T` is made of atomic words only (private,
        // and called so above and below), for which any bytes are a value and which may be shared with other processes.
        unsafe { self.memory.at(line * LINE).cast().as_ref() }
    }

    /// Returns the bytes of a buffer; an end accesses only buffers that [`TripleMemory::given`] returned.
    fn buffer(&self, index: u8) -> *mut [u8] {
        let index = usize::from(index).min(BUFFERS - 1);
        let start = self.memory.at(LINES_OF_WORDS * LINE + index * lines(self.buffer_len));
        std::ptr::slice_from_raw_parts_mut(start.as_ptr(), self.buffer_len)
    }

    /// Returns true if `rows` is a possible number of waiting rows; otherwise marks the connection as lost.
    #[inline]
    fn may_wait(&self, rows: usize) -> bool {
        if rows > self.depth {
            self.fate.lose(Word::Rows, rows as u64);
        }
        rows <= self.depth && !self.is_lost()
    }

    /// Returns the number and bytes of the row in a slot.
    fn slot(&self, slot: usize) -> (*mut u64, *mut [u8]) {
        let rows = LINES_OF_WORDS * LINE + BUFFERS * lines(self.buffer_len);
        let start = rows + slot * slot_len(self.row_len);
        let number = self.memory.at(start + number_at(self.row_len)).cast().as_ptr();
        (number, std::ptr::slice_from_raw_parts_mut(self.memory.at(start).as_ptr(), self.row_len))
    }
}

// SAFETY: the mapping stays where it is while `self` lives; buffers are apart by whole lines; that there is one end of each kind at a time is
// kept by the claims in `connection`. A process at the other end that does not keep to it can write what it likes there, and no address.
unsafe impl TripleMemory for Layout {
    #[inline]
    fn middle(&self) -> &AtomicU8 {
        self.word(1)
    }

    #[inline]
    fn for_reading(&self, index: u8) -> *const [u8] {
        self.buffer(index)
    }

    #[inline]
    fn for_writing(&self, index: u8) -> *mut [u8] {
        self.buffer(index)
    }

    #[inline]
    fn given(&self, word: u8, own: u8) -> u8 {
        if is_possible(word, own) {
            return in_the_middle(word);
        }
        self.fate.lose(Word::Middle, word.into());
        own
    }
}

// SAFETY: as above; slots are apart by whole lines, and a queue end is made only where the depth is not 0.
unsafe impl QueueMemory for Layout {
    #[inline]
    fn popped(&self) -> &AtomicUsize {
        self.word(5)
    }

    #[inline]
    fn pushed(&self) -> &AtomicUsize {
        self.word(4)
    }

    #[inline]
    fn depth(&self) -> usize {
        self.depth
    }

    #[inline]
    fn for_reading(&self, slot: usize) -> (*const u64, *const [u8]) {
        let (number, row) = self.slot(slot);
        (number, row)
    }

    #[inline]
    fn for_writing(&self, slot: usize) -> (*mut u64, *mut [u8]) {
        self.slot(slot)
    }

    /// Returns the reader's count; if the connection is lost, the queue appears full to the writer.
    #[inline]
    fn popped_of(&self, pushed: usize) -> usize {
        let popped = self.popped().load(Ordering::Acquire);
        if self.may_wait(pushed.wrapping_sub(popped)) { popped } else { pushed.wrapping_sub(self.depth) }
    }

    /// Returns the writer's count; if the connection is lost, the queue appears empty to the reader.
    #[inline]
    fn pushed_of(&self, popped: usize) -> usize {
        let pushed = self.pushed().load(Ordering::Acquire);
        if self.may_wait(pushed.wrapping_sub(popped)) { pushed } else { popped }
    }
}
