// SPDX-License-Identifier: Apache-2.0
//! The ring of rows: the last rows that one writer wrote, for any number of readers (the programming system, the recorder).
//!
//! | | writer | a reader |
//! |---|---|---|
//! | may block the other | never | never, nor another reader |
//! | steps of a row | its words, two stores, one fence; no look at the readers | its words, two loads, one fence |
//! | retries | none | when the writer overtook it: it takes a newer row, or counts the lost one |
//! | if the writer is stopped or killed inside a row | | reads all rows but the oldest, whose place was being written |
//!
//! Each row has a stamp, odd while the row is written (a sequence lock for each row). A reader copies the words and keeps the
//! copy only if the stamp was the same, even one before and after. All words are atomic and relaxed, so a copy that is thrown
//! away is no data race either. `depth` is how far the writer may run ahead of a reader that is reading.
//!
//! (A sequence lock does not do between interrupt sources, whose reader must not retry; the readers here are no part of the
//! real-time path.)
use crate::ahead::will_write;
use crate::sync::{Arc, AtomicU64, Ordering, OwnLine, fence, spin_loop};

/// Makes a ring of `depth` rows of `row_len` bytes. Panics if `depth` is below 2: the newest row must outlast the next write.
pub fn rows(row_len: usize, depth: usize) -> (RowsWriter, RowsReader) {
    assert!(depth >= 2, "a ring of rows needs two rows or more");
    let words_len = HEADER_WORDS + row_len.div_ceil(WORD);
    let words = (0..words_len * depth).map(|_| AtomicU64::new(0)).collect();
    let shared = Arc::new(SharedRing { written: OwnLine(AtomicU64::new(0)), words, words_len, row_len, depth });
    (RowsWriter { shared: shared.clone(), written: 0, next: 0 }, RowsReader { shared })
}

/// The writing end: one writer at a time.
pub struct RowsWriter {
    shared: Arc<SharedRing>,
    /// Rows written so far, the sequence of the next one.
    written: u64,
    /// Its place in the ring.
    next: usize,
}

impl RowsWriter {
    /// Writes a row: `fill` puts its bytes one segment after the other; what it leaves is zero. Readers see all of the row or
    /// nothing. A `fill` that panics writes no row. Wait-free, real-time safe.
    #[inline]
    pub fn write(&mut self, number: u64, time_ns: i64, fill: impl FnOnce(&mut RowSink)) {
        let shared = &*self.shared;
        let row = shared.place(self.next);
        row[STAMP].store(stamp_of(self.written) - 1, Ordering::Relaxed);
        // A reader of a word stored below sees, after its acquire fence, the odd stamp stored above.
        fence(Ordering::Release);
        row[NUMBER].store(number, Ordering::Relaxed);
        row[TIME].store(time_ns.cast_unsigned(), Ordering::Relaxed);
        let mut sink = RowSink { words: &row[HEADER_WORDS..], room: shared.row_len, partial: 0, partial_len: 0 };
        fill(&mut sink);
        sink.finish();
        row[STAMP].store(stamp_of(self.written), Ordering::Relaxed);
        self.written += 1;
        self.next = if self.next + 1 == shared.depth { 0 } else { self.next + 1 };
        // A reader that has seen this count sees all of the row.
        shared.written.0.store(self.written, Ordering::Release);
    }

    /// Asks for the memory of the next row, so that `write` need not wait for it. To be called some hundred nanoseconds before; it may be
    /// left out.
    #[inline]
    pub fn expect(&self) {
        will_write(self.shared.place(self.next));
        will_write(std::slice::from_ref(&self.shared.written));
    }

    /// Rows that were lost before they came here: readers count as many as lost before the next row. For a ring that repeats the rows
    /// of another one.
    pub fn skip(&mut self, lost: u64) {
        self.written += lost;
        self.next = (self.written % self.shared.depth as u64) as usize;
    }

    /// Bytes of a row.
    pub fn row_len(&self) -> usize {
        self.shared.row_len
    }

    /// Rows that it holds.
    pub fn depth(&self) -> usize {
        self.shared.depth
    }

    /// Returns another reader of this ring.
    pub fn reader(&self) -> RowsReader {
        RowsReader { shared: self.shared.clone() }
    }
}

/// A row that is being written.
pub struct RowSink<'a> {
    /// The words that are not stored yet.
    words: &'a [AtomicU64],
    /// Bytes that may still be put.
    room: usize,
    /// The first bytes of the next word.
    partial: u64,
    partial_len: usize,
}

impl RowSink<'_> {
    /// Appends a segment. Panics if the row has no room for it. Segments of whole words (8 bytes) are the fast ones.
    #[inline]
    pub fn put(&mut self, segment: &[u8]) {
        assert!(segment.len() <= self.room, "a segment of {} bytes does not fit into the {} left in the row", segment.len(), self.room);
        self.room -= segment.len();
        if self.partial_len != 0 {
            return self.put_unaligned(segment);
        }
        let (whole, rest) = segment.as_chunks::<WORD>();
        let (now, later) = self.words.split_at(whole.len());
        for (word, bytes) in now.iter().zip(whole) {
            word.store(u64::from_le_bytes(*bytes), Ordering::Relaxed);
        }
        self.words = later;
        self.put_unaligned(rest);
    }

    #[inline]
    fn put_unaligned(&mut self, segment: &[u8]) {
        for &byte in segment {
            self.partial |= u64::from(byte) << (8 * self.partial_len);
            self.partial_len += 1;
            if self.partial_len == WORD {
                self.flush();
            }
        }
    }

    #[inline]
    fn flush(&mut self) {
        let (word, later) = self.words.split_first().expect("`put` has checked that there is room");
        word.store(self.partial, Ordering::Relaxed);
        (self.words, self.partial, self.partial_len) = (later, 0, 0);
    }

    #[inline]
    fn finish(mut self) {
        if self.partial_len != 0 {
            self.flush();
        }
        for word in self.words {
            word.store(0, Ordering::Relaxed);
        }
    }
}

/// A row as it was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Row {
    /// Number of rows that were written before it.
    pub sequence: u64,
    /// The writer's number.
    pub number: u64,
    /// The writer's time, ns on the clock.
    pub time_ns: i64,
    /// `row_len` bytes.
    pub bytes: Vec<u8>,
}

/// A reading end, for any thread; a clone is another. Allocates: not for the real-time path.
#[derive(Clone)]
pub struct RowsReader {
    shared: Arc<SharedRing>,
}

impl RowsReader {
    /// Returns the newest row; none before the first. Retries when the writer overtook it by the depth of the ring.
    pub fn newest(&self) -> Option<Row> {
        loop {
            let written = self.written();
            if written == 0 {
                return None;
            }
            if let Some(row) = self.row(written - 1) {
                return Some(row);
            }
            spin_loop();
        }
    }

    /// Appends the rows from `sequence` on to `out`, oldest first, and returns how many of them were lost, written over before they
    /// could be read. The next call asks from `sequence` + lost + appended on.
    pub fn since(&self, sequence: u64, out: &mut Vec<Row>) -> u64 {
        let end = self.written();
        let first = sequence.max(end.saturating_sub(self.shared.depth as u64));
        let mut lost = first.saturating_sub(sequence);
        for wanted in first..end {
            match self.row(wanted) {
                Some(row) => out.push(row),
                None => lost += 1,
            }
        }
        lost
    }

    /// Copies the oldest row from `sequence` on that is still there to `into`, whose memory it uses again, and returns how many before
    /// it were lost; the next call asks from `into.sequence` + 1 on. None, and nothing copied, where no row has been written since.
    pub fn next(&self, sequence: u64, into: &mut Row) -> Option<u64> {
        let mut wanted = sequence;
        loop {
            let end = self.written();
            if wanted >= end {
                return None;
            }
            wanted = wanted.max(end.saturating_sub(self.shared.depth as u64));
            if self.copy(wanted, into) {
                return Some(wanted - sequence);
            }
            wanted += 1;
        }
    }

    /// Returns the last `n` rows or fewer, oldest first. A row that was written over while they were read is left out with the older ones.
    pub fn last(&self, n: usize) -> Vec<Row> {
        let mut out = Vec::new();
        self.since(self.written().saturating_sub(n as u64), &mut out);
        // More may have been written since the count was taken.
        out.drain(..out.len().saturating_sub(n));
        out
    }

    /// Rows written so far: the sequence of the next one.
    pub fn written(&self) -> u64 {
        self.shared.written.0.load(Ordering::Acquire)
    }

    /// Bytes of a row.
    pub fn row_len(&self) -> usize {
        self.shared.row_len
    }

    /// Rows that the ring holds.
    pub fn depth(&self) -> usize {
        self.shared.depth
    }

    /// Returns row `sequence`, which has been written; none if it was written over.
    fn row(&self, sequence: u64) -> Option<Row> {
        let mut row = Row { bytes: Vec::with_capacity(self.shared.words_len * WORD), ..Row::default() };
        self.copy(sequence, &mut row).then_some(row)
    }

    /// Copies it to where another row was; false if it was written over, and what is in `into` then is no row.
    fn copy(&self, sequence: u64, into: &mut Row) -> bool {
        let row = self.shared.place((sequence % self.shared.depth as u64) as usize);
        // The caller has seen the count of written rows, so what is read here is of this row or a later one, never an earlier.
        if row[STAMP].load(Ordering::Relaxed) != stamp_of(sequence) {
            return false;
        }
        into.sequence = sequence;
        into.number = row[NUMBER].load(Ordering::Relaxed);
        into.time_ns = row[TIME].load(Ordering::Relaxed).cast_signed();
        into.bytes.clear();
        for word in &row[HEADER_WORDS..] {
            into.bytes.extend_from_slice(&word.load(Ordering::Relaxed).to_le_bytes());
        }
        // If a word above was of a later row, the odd stamp before it is visible from here on.
        fence(Ordering::Acquire);
        into.bytes.truncate(self.shared.row_len);
        row[STAMP].load(Ordering::Relaxed) == stamp_of(sequence)
    }
}

struct SharedRing {
    /// Rows written so far; each is complete.
    written: OwnLine<AtomicU64>,
    /// `depth` rows of `words_len` words: stamp, number, time, bytes.
    words: Box<[AtomicU64]>,
    words_len: usize,
    row_len: usize,
    depth: usize,
}

impl SharedRing {
    #[inline]
    fn place(&self, place: usize) -> &[AtomicU64] {
        &self.words[place * self.words_len..][..self.words_len]
    }
}

/// Returns the stamp of a complete row: even, never that of another row, never the 0 of a place that was not written yet. One less
/// while it is written.
fn stamp_of(sequence: u64) -> u64 {
    2 * sequence + 2
}

const WORD: usize = 8;
const STAMP: usize = 0;
const NUMBER: usize = 1;
const TIME: usize = 2;
const HEADER_WORDS: usize = 3;

#[cfg(all(test, not(loom)))]
mod tests;
