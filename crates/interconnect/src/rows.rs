// SPDX-License-Identifier: Apache-2.0
//! Ring of rows: the most recent rows of one writer, for any number of readers (the programming system, the recorder).
//!
//! | | writer | a reader |
//! |---|---|---|
//! | may block the other | never | never, nor another reader |
//! | steps of a row | its words, two stores, one fence; no access to the readers | its words, two loads, one fence |
//! | retries | none | if the writer overtook it: it takes a newer row, or counts the lost one |
//! | if the writer is stopped or killed inside a row | | reads all rows but the oldest, which was being overwritten |
//!
//! Each row has a stamp, which is odd while the row is being written (a sequence lock for each row). A reader copies the words and keeps
//! the copy only if the stamp was even, and the same before and after. All words are atomic and relaxed, so even a discarded copy is not
//! a data race. The writer may run ahead of a reader by up to `depth` rows while it reads.
//!
//! (A sequence lock is unsuitable between interrupt sources, whose reader must not retry; the readers here are not part of the real-time
//! path.)
use crate::ahead::will_write;
use crate::sync::{Arc, AtomicU64, Ordering, OwnLine, fence, spin_loop};

/// Creates a ring of `depth` rows of `row_len` bytes. Panics if `depth` is below 2, because the newest row must outlast the next write.
pub fn rows(row_len: usize, depth: usize) -> (RowsWriter, RowsReader) {
    assert!(depth >= 2, "a ring of rows needs two rows or more");
    let words_len = HEADER_WORDS + row_len.div_ceil(WORD);
    let words = (0..words_len * depth).map(|_| AtomicU64::new(0)).collect();
    let shared = Arc::new(SharedRing { written: OwnLine(AtomicU64::new(0)), words, words_len, row_len, depth });
    (RowsWriter { shared: shared.clone(), written: 0, next: 0 }, RowsReader { shared })
}

/// Writing end: one writer at a time.
pub struct RowsWriter {
    shared: Arc<SharedRing>,
    /// Number of rows written so far; also the sequence number of the next one.
    written: u64,
    /// Index of the next row in the ring.
    next: usize,
}

impl RowsWriter {
    /// Writes a row: `fill` appends its bytes segment by segment; the remainder is zero. Readers see either all of the row or nothing. If
    /// `fill` panics, no row is written. Wait-free, real-time safe.
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

    /// Prefetches the memory of the next row, so that `write` does not wait for it. Optional; call it a few hundred nanoseconds before
    /// `write`.
    #[inline]
    pub fn expect(&self) {
        will_write(self.shared.place(self.next));
        will_write(std::slice::from_ref(&self.shared.written));
    }

    /// Skips `lost` rows that were lost before they arrived here; readers count them as lost before the next row. For a ring that mirrors
    /// the rows of another one.
    pub fn skip(&mut self, lost: u64) {
        self.written += lost;
        self.next = (self.written % self.shared.depth as u64) as usize;
    }

    /// Returns the size of a row in bytes.
    pub fn row_len(&self) -> usize {
        self.shared.row_len
    }

    /// Returns the capacity in rows.
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
    /// Words that are not stored yet.
    words: &'a [AtomicU64],
    /// Number of bytes that may still be appended.
    room: usize,
    /// First bytes of the next word.
    partial: u64,
    partial_len: usize,
}

impl RowSink<'_> {
    /// Appends a segment. Panics if it does not fit in the row. Segments of whole words (8 bytes) are fastest.
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

/// A row that was read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Row {
    /// Number of rows written before this one.
    pub sequence: u64,
    /// Number assigned by the writer.
    pub number: u64,
    /// Time assigned by the writer, ns on the clock.
    pub time_ns: i64,
    /// Contents, `row_len` bytes.
    pub bytes: Vec<u8>,
}

/// Reading end, for any thread; a clone is an independent reader. Allocates, so it is not for the real-time path.
#[derive(Clone)]
pub struct RowsReader {
    shared: Arc<SharedRing>,
}

impl RowsReader {
    /// Returns the newest row; `None` before the first. Retries if the writer got ahead by the depth of the ring during the read.
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

    /// Appends the rows from `sequence` on to `out`, oldest first, and returns the number of lost rows, which were overwritten before
    /// they could be read. The next call continues at `sequence` + lost + appended.
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

    /// Copies the oldest available row from `sequence` on to `into`, reusing its memory, and returns the number of lost rows before it;
    /// the next call continues at `into.sequence` + 1. Returns `None` and copies nothing if no row has been written since.
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

    /// Returns up to `n` of the most recent rows, oldest first. If a row is overwritten during the read, it and all older rows are left
    /// out.
    pub fn last(&self, n: usize) -> Vec<Row> {
        let mut out = Vec::new();
        self.since(self.written().saturating_sub(n as u64), &mut out);
        // More may have been written since the count was taken.
        out.drain(..out.len().saturating_sub(n));
        out
    }

    /// Returns the number of rows written so far; also the sequence number of the next one.
    pub fn written(&self) -> u64 {
        self.shared.written.0.load(Ordering::Acquire)
    }

    /// Returns the size of a row in bytes.
    pub fn row_len(&self) -> usize {
        self.shared.row_len
    }

    /// Returns the capacity in rows.
    pub fn depth(&self) -> usize {
        self.shared.depth
    }

    /// Returns row `sequence`, which must have been written; `None` if it has been overwritten.
    fn row(&self, sequence: u64) -> Option<Row> {
        let mut row = Row { bytes: Vec::with_capacity(self.shared.words_len * WORD), ..Row::default() };
        self.copy(sequence, &mut row).then_some(row)
    }

    /// Copies row `sequence` into an existing row; returns false if it has been overwritten, which leaves `into` invalid.
    fn copy(&self, sequence: u64, into: &mut Row) -> bool {
        let row = self.shared.place((sequence % self.shared.depth as u64) as usize);
        // The caller has read the count of written rows, so the words read here belong to this row or a later one, never an earlier.
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
        // If a word above belonged to a later row, the odd stamp before it is visible after this fence.
        fence(Ordering::Acquire);
        into.bytes.truncate(self.shared.row_len);
        row[STAMP].load(Ordering::Relaxed) == stamp_of(sequence)
    }
}

struct SharedRing {
    /// Number of rows written so far; each is complete.
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

/// Returns the stamp of a complete row: even, different from that of any other row and from the 0 of an unwritten slot. The stamp is one
/// less while the row is being written.
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
