// SPDX-License-Identifier: Apache-2.0
//! State of the two ends of a connection over messages. Contains neither a link nor a clock; its users provide them: `traffic` under the
//! virtual clock, crate `hosts` over a network.
//!
//! Group: the newest publication wins. The writing end keeps it until the reading end has acknowledged it; an older one that arrives late
//! is ignored. Rows: the writing end keeps each row until the reading end has received all rows up to it; rows are read in order, each
//! exactly once. The reading end keeps reporting the number of popped rows until the writing end acknowledges it, so that a writing end
//! whose queue was full always learns when there is space.
use super::packet::Content;
use crate::carrier::Header;
use std::collections::{BTreeMap, VecDeque};

/// State of the writing end.
pub struct WritingEnd {
    depth: u64,
    window: u64,
    /// Number of publications so far; also the sequence number of the newest one.
    published: u64,
    /// Newest publication, kept until its arrival is acknowledged.
    group: Option<(Header, Vec<u8>)>,
    /// Numbers of rows: pushed, acknowledged as arrived, and acknowledged as popped.
    pushed: u64,
    received: u64,
    popped: u64,
    /// Rows from `received` to `pushed`.
    rows: VecDeque<(u64, Vec<u8>)>,
}

impl WritingEnd {
    /// Creates the end for a reader with space for `depth` waiting rows, with at most `window` rows in transit.
    pub fn new(depth: usize, window: usize) -> Self {
        let (depth, window) = (depth as u64, window as u64);
        WritingEnd { depth, window, published: 0, group: None, pushed: 0, received: 0, popped: 0, rows: VecDeque::new() }
    }

    /// Accepts a publication, which becomes the newest one.
    pub fn publish(&mut self, header: Header, bytes: &[u8]) {
        self.published += 1;
        self.group = Some((header, bytes.to_vec()));
    }

    /// Returns the newest publication, unless its arrival has been acknowledged.
    pub fn group(&self) -> Option<Content<'_>> {
        let (header, bytes) = self.group.as_ref()?;
        Some(Content::Group { sequence: self.published, header: *header, bytes })
    }

    /// Returns the number of publications so far; also the sequence number of the newest one.
    pub fn published(&self) -> u64 {
        self.published
    }

    /// Records that the reading end has received publication `sequence`.
    pub fn group_received(&mut self, sequence: u64) {
        if sequence == self.published {
            self.group = None;
        }
    }

    /// Returns true if another row may be pushed: as far as is known, fewer than `depth` rows wait for the reader and fewer than `window`
    /// are in transit.
    pub fn has_room(&self) -> bool {
        self.pushed < self.room_until()
    }

    /// Returns the number of rows pushed so far.
    pub fn pushed(&self) -> u64 {
        self.pushed
    }

    /// Returns the number of rows acknowledged as arrived.
    pub fn received(&self) -> u64 {
        self.received
    }

    /// Returns the total number of pushed rows up to which there is space, as far as is known.
    pub fn room_until(&self) -> u64 {
        if self.received - self.popped < self.depth { self.received + self.window } else { self.pushed }
    }

    /// Appends a row and returns its sequence number.
    pub fn push(&mut self, number: u64, bytes: Vec<u8>) -> u64 {
        self.rows.push_back((number, bytes));
        self.pushed += 1;
        self.pushed - 1
    }

    /// Returns the unacknowledged rows from `sequence` on.
    pub fn rows(&self, sequence: u64) -> impl Iterator<Item = Content<'_>> {
        let rows = (self.received..).zip(&self.rows).skip_while(move |(of, _)| *of < sequence);
        rows.map(|(sequence, (number, bytes))| Content::Row { sequence, number: *number, bytes })
    }

    /// Returns true if there are unacknowledged rows.
    pub fn has_rows(&self) -> bool {
        !self.rows.is_empty()
    }

    /// Records that the reading end has received the first `count` rows. Returns true if this had not been recorded yet.
    pub fn rows_received(&mut self, count: u64) -> bool {
        let news = count.min(self.pushed).saturating_sub(self.received);
        self.rows.drain(..news as usize);
        self.received += news;
        news > 0
    }

    /// Records that the reader has popped `count` rows. Returns the number of rows known to be popped, limited to those acknowledged as
    /// arrived.
    pub fn rows_popped(&mut self, count: u64) -> u64 {
        self.popped = self.popped.max(count.min(self.received));
        self.popped
    }
}

/// State of the reading end.
pub struct ReadingEnd {
    group_len: usize,
    row_len: Option<usize>,
    /// Sequence number of the newest publication that has arrived.
    newest: u64,
    /// Newest group, kept until it is latched.
    group: Option<(Header, Vec<u8>)>,
    /// Rows that arrived before a row that is still missing.
    early: BTreeMap<u64, (u64, Vec<u8>)>,
    /// Readable rows.
    ready: VecDeque<(u64, Vec<u8>)>,
    /// Numbers of rows: arrived in order, popped, and known to the writing end as popped.
    received: u64,
    popped: u64,
    popped_known: u64,
}

impl ReadingEnd {
    /// Creates the end for groups and rows of these lengths; without a row length, it accepts rows of any length.
    pub fn new(group_len: usize, row_len: Option<usize>) -> Self {
        let (early, ready) = (BTreeMap::new(), VecDeque::new());
        ReadingEnd { group_len, row_len, newest: 0, group: None, early, ready, received: 0, popped: 0, popped_known: 0 }
    }

    /// Accepts a publication, and returns the sequence number of the newest one; `None` if it does not belong to this connection.
    pub fn group_came(&mut self, sequence: u64, header: Header, bytes: &[u8]) -> Option<u64> {
        if bytes.len() != self.group_len {
            return None;
        }
        if sequence > self.newest {
            self.newest = sequence;
            self.group = Some((header, bytes.to_vec()));
        }
        Some(self.newest)
    }

    /// Takes the newest publication if it has not been latched yet.
    pub fn latch(&mut self) -> Option<(Header, Vec<u8>)> {
        self.group.take()
    }

    /// Accepts a row, and returns the number of rows that became readable; `None` if it does not belong to this connection.
    pub fn row_came(&mut self, sequence: u64, number: u64, bytes: &[u8]) -> Option<usize> {
        if self.row_len.is_some_and(|len| len != bytes.len()) {
            return None;
        }
        if sequence >= self.received {
            self.early.insert(sequence, (number, bytes.to_vec()));
        }
        let before = self.received;
        while let Some(row) = self.early.remove(&self.received) {
            self.ready.push_back(row);
            self.received += 1;
        }
        Some((self.received - before) as usize)
    }

    /// Returns the number of rows that arrived in order.
    pub fn received(&self) -> u64 {
        self.received
    }

    /// Returns the sequence number of the newest publication that has arrived; 0 before the first.
    pub fn newest(&self) -> u64 {
        self.newest
    }

    /// Returns true if a row has arrived before one that is still missing.
    pub fn has_gap(&self) -> bool {
        !self.early.is_empty()
    }

    /// Returns the number and bytes of the oldest row without removing it.
    pub fn oldest(&self) -> Option<&(u64, Vec<u8>)> {
        self.ready.front()
    }

    /// Returns the number of readable rows.
    pub fn ready(&self) -> usize {
        self.ready.len()
    }

    /// Pops the oldest row; returns true if there was one.
    pub fn pop(&mut self) -> bool {
        let popped = self.take().is_some();
        self.popped += u64::from(popped);
        popped
    }

    /// Takes out the oldest row, for a reader that pops it later ([`popped`](Self::popped)).
    pub fn take(&mut self) -> Option<(u64, Vec<u8>)> {
        self.ready.pop_front()
    }

    /// Records that the reader has popped `count` of the rows that were taken out.
    pub fn popped(&mut self, count: u64) {
        self.popped = self.popped.max(count.min(self.received));
    }

    /// Returns the number of rows that have arrived but not been popped.
    pub fn waiting(&self) -> u64 {
        self.received - self.popped
    }

    /// Returns the number of popped rows to report to the writing end; `None` if it has already acknowledged this number.
    pub fn room_news(&self) -> Option<Content<'static>> {
        (self.popped_known < self.popped).then_some(Content::RowsPopped { count: self.popped })
    }

    /// Records the writing end's acknowledgement that `count` rows were popped.
    pub fn room_known(&mut self, count: u64) {
        self.popped_known = self.popped_known.max(count.min(self.popped));
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    const HEADER: Header = Header { number: 0, time_ns: 0 };

    #[test]
    fn a_row_that_comes_again_is_not_kept() {
        let mut reading = ReadingEnd::new(0, Some(1));
        for (sequence, readable) in [(2, 0), (1, 0), (2, 0), (0, 3), (0, 0), (1, 0), (3, 1)] {
            assert_eq!(reading.row_came(sequence, sequence, &[0]), Some(readable), "row {sequence}");
        }
        assert!(reading.early.is_empty());
        let numbers = std::iter::from_fn(|| reading.oldest().map(|row| row.0).filter(|_| reading.pop()));
        assert_eq!(numbers.collect::<Vec<_>>(), [0, 1, 2, 3]);
    }

    #[test]
    fn a_group_or_row_of_another_length_is_refused() {
        let mut reading = ReadingEnd::new(2, Some(3));
        assert_eq!(reading.group_came(1, HEADER, &[0; 3]), None);
        assert_eq!(reading.row_came(0, 0, &[0; 2]), None);
        assert!(reading.latch().is_none() && reading.oldest().is_none());
    }

    #[test]
    fn room_is_what_neither_waits_nor_is_on_its_way() {
        let mut writing = WritingEnd::new(2, 3);
        let fill = |writing: &mut WritingEnd| {
            let mut pushed = 0;
            while writing.has_room() {
                writing.push(0, Vec::new());
                pushed += 1;
            }
            pushed
        };
        assert_eq!(fill(&mut writing), 3, "three may be on their way");
        assert!(writing.rows_received(1));
        assert_eq!(fill(&mut writing), 1);
        assert!(writing.rows_received(2));
        assert_eq!(fill(&mut writing), 0, "two wait");
        assert_eq!(writing.rows_popped(1), 1);
        assert_eq!(fill(&mut writing), 1);
        assert!(!writing.rows_received(1), "an old answer is no news");
        assert_eq!(writing.rows_popped(9), 2, "no more are popped than have arrived");
    }
}
