// SPDX-License-Identifier: Apache-2.0
//! Carriers of connections: one trait for memory, messages, and whatever comes.
use std::fmt;

/// A connection from one interrupt source to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ConnectionSpec {
    /// The writing source.
    pub writer: u32,
    /// The reading source.
    pub reader: u32,
    /// Bytes of the asynchronous members, published as one group.
    pub asynchronous_len: usize,
    /// Bytes of a row of the synchronous and ratio members.
    pub queue_row_len: usize,
    /// Rows that may wait at the reader; 0 for a connection without a queue.
    pub queue_depth: usize,
}

/// Carrier of connections. Threads, shared memory and network differ only in this.
pub trait Carrier: Send {
    /// Makes a connection: its writing end and its reading end. Not on the real-time path.
    fn connect(&mut self, spec: &ConnectionSpec) -> (Box<dyn Sender>, Box<dyn Receiver>);

    /// Returns the time of the next event on the way (an arrival, a retransmission), ns on the clock; none while nothing is under way. A carrier
    /// that delivers within the sender's call never has any.
    fn next_arrival(&self) -> Option<i64>;

    /// Makes everything arrive that is due at `now_ns`, and calls `raise` with the reading source once for each row that became
    /// readable since the last call, in order of arrival; but not for a row that became readable within its own push
    /// ([`Sender::arrived`]). A group raises nobody: asynchronous members start no one.
    fn deliver(&mut self, now_ns: i64, raise: &mut dyn FnMut(u32));
}

/// The writing end of a connection. All calls but those of [`Message`](crate::Message) are real-time safe.
pub trait Sender: Send {
    /// Returns the bytes of the next publication, `asynchronous_len` of them, starting on a cache line. They hold an earlier group or
    /// anything: fill them whole each time.
    fn group(&mut self) -> &mut [u8];

    /// Publishes the group with the writer's number and time: the reader gets all of it or nothing.
    fn publish(&mut self, number: u64, now_ns: i64);

    /// Appends a row: `fill` writes its `queue_row_len` bytes, which hold an earlier row or anything. [`Full`], without calling `fill`,
    /// where the reader has too many waiting. Panics on a connection without a queue.
    fn push(&mut self, number: u64, now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full>;

    /// Returns true if the row pushed last was readable when `push` returned: then the writing source raises the reading one
    /// itself, once a firing. Else [`Carrier::deliver`] raises it on arrival. Always true in memory.
    fn arrived(&self) -> bool {
        true
    }
}

/// The reading end of a connection. All calls but those of [`Message`](crate::Message) are real-time safe.
pub trait Receiver: Send {
    /// Takes the newest group, if there is one that it has not had. `None` where there is no news, so always before the first
    /// publication.
    fn latch(&mut self, now_ns: i64) -> Option<Header>;

    /// Returns the group latched last, `asynchronous_len` bytes; zeros before the first. It stays until the next latch.
    fn group(&self) -> &[u8];

    /// Returns the writer's number and the bytes of the oldest row, which stays; none if no row waits.
    fn peek_row(&mut self) -> Option<(u64, &[u8])>;

    /// Removes the oldest row; false where no row waits.
    fn pop_row(&mut self) -> bool;

    /// Rows that wait.
    fn rows(&self) -> usize;
}

/// Publisher of a group, and the time of the publication.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Header {
    /// The writer's number.
    pub number: u64,
    /// The writer's time, ns on the clock.
    pub time_ns: i64,
}

impl Header {
    /// Bytes of a header in memory.
    pub const LEN: usize = 16;

    /// Returns its offset in memory, behind a group of `group_len` bytes: the group begins on a cache line, and where it is small both share
    /// that line, so that one line goes from core to core.
    #[inline]
    pub fn behind(group_len: usize) -> usize {
        group_len.next_multiple_of(align_of::<u64>())
    }

    /// Puts it into memory, `at` bytes from the start.
    #[inline]
    pub fn write(self, memory: &mut [u8], at: usize) {
        memory[at..at + 8].copy_from_slice(&self.number.to_ne_bytes());
        memory[at + 8..at + Self::LEN].copy_from_slice(&self.time_ns.to_ne_bytes());
    }

    /// Reads the header that [`write`](Self::write) put there.
    #[inline]
    pub fn read(memory: &[u8], at: usize) -> Self {
        let word = |at: usize| memory[at..at + 8].try_into().expect("eight bytes were cut out");
        Header { number: u64::from_ne_bytes(word(at)), time_ns: i64::from_ne_bytes(word(at + 8)) }
    }

    /// Returns the age of the group at `now_ns`, ns.
    pub fn age_ns(&self, now_ns: i64) -> i64 {
        now_ns.saturating_sub(self.time_ns)
    }
}

/// The reader has not taken enough: there is no room for another row. Real-time code turns it into the condition `overrun`,
/// which names both ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

impl fmt::Display for Full {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the queue between the writing and the reading source is full; let the reader run as often as the writer, or bind asynchronously")
    }
}

impl std::error::Error for Full {}
