// SPDX-License-Identifier: Apache-2.0
//! Carriers of connections: one trait for memory, messages and other media.
use std::fmt;

/// A connection from one interrupt source to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ConnectionSpec {
    /// Writing source.
    pub writer: u32,
    /// Reading source.
    pub reader: u32,
    /// Size of the asynchronous members, published as one group, in bytes.
    pub asynchronous_len: usize,
    /// Size of a row of the synchronous and ratio members, in bytes.
    pub queue_row_len: usize,
    /// Maximum number of rows that wait for the reader; 0 for a connection without a queue.
    pub queue_depth: usize,
}

/// Carrier of connections. Threads, shared memory and network differ only in their carriers.
pub trait Carrier: Send {
    /// Creates both ends of a connection: the writing end and the reading end. Not on the real-time path.
    fn connect(&mut self, spec: &ConnectionSpec) -> (Box<dyn Sender>, Box<dyn Receiver>);

    /// Returns the time of the next pending event (an arrival, a retransmission), ns on the clock; `None` if nothing is in transit.
    /// Always `None` for a carrier that delivers within the sender's call.
    fn next_arrival(&self) -> Option<i64>;

    /// Delivers everything that is due at `now_ns`, and calls `raise` with the reading source once for each row that became readable
    /// since the last call, in order of arrival. Rows that became readable within their own push ([`Sender::arrived`]) are excluded.
    /// Groups do not raise a source, because asynchronous members do not trigger a firing.
    fn deliver(&mut self, now_ns: i64, raise: &mut dyn FnMut(u32));
}

/// Writing end of a connection. All calls except those of [`Message`](crate::Message) are real-time safe.
pub trait Sender: Send {
    /// Returns the buffer of the next publication, `asynchronous_len` bytes that start on a cache line. Its initial contents are
    /// arbitrary (possibly an earlier group), so all of it must be overwritten each time.
    fn group(&mut self) -> &mut [u8];

    /// Publishes the group with the writer's number and time. The reader receives either all of it or nothing.
    fn publish(&mut self, number: u64, now_ns: i64);

    /// Appends a row: `fill` writes its `queue_row_len` bytes, whose initial contents are arbitrary. Returns [`Full`] without calling
    /// `fill` if the queue is full. Panics on a connection without a queue.
    fn push(&mut self, number: u64, now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full>;

    /// Returns true if the row pushed last was readable when `push` returned. In that case, the writing source raises the reading source
    /// itself, once per firing. Otherwise, [`Carrier::deliver`] raises it on arrival. Always true in memory.
    fn arrived(&self) -> bool {
        true
    }
}

/// Reading end of a connection. All calls except those of [`Message`](crate::Message) are real-time safe.
pub trait Receiver: Send {
    /// Takes the newest group. Returns `None` if it has already been taken or nothing has been published yet.
    fn latch(&mut self, now_ns: i64) -> Option<Header>;

    /// Returns the group latched last, `asynchronous_len` bytes; zeros before the first. It stays valid until the next latch.
    fn group(&self) -> &[u8];

    /// Returns the writer's number and the bytes of the oldest row without removing it; `None` if no row waits.
    fn peek_row(&mut self) -> Option<(u64, &[u8])>;

    /// Removes the oldest row; returns false if no row waits.
    fn pop_row(&mut self) -> bool;

    /// Returns the number of waiting rows.
    fn rows(&self) -> usize;
}

/// Number and time of a publication.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Header {
    /// Number assigned by the writer.
    pub number: u64,
    /// Time assigned by the writer, ns on the clock.
    pub time_ns: i64,
}

impl Header {
    /// Size of a header in memory, in bytes.
    pub const LEN: usize = 16;

    /// Returns the offset of the header in memory, after a group of `group_len` bytes. The group begins on a cache line, and a small
    /// group shares that line with the header, so that only one line moves between cores.
    #[inline]
    pub fn behind(group_len: usize) -> usize {
        group_len.next_multiple_of(align_of::<u64>())
    }

    /// Writes the header to memory, `at` bytes from the start.
    #[inline]
    pub fn write(self, memory: &mut [u8], at: usize) {
        memory[at..at + 8].copy_from_slice(&self.number.to_ne_bytes());
        memory[at + 8..at + Self::LEN].copy_from_slice(&self.time_ns.to_ne_bytes());
    }

    /// Reads a header written by [`write`](Self::write).
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

/// Error: the queue is full because the reader has fallen behind. Real-time code turns it into the condition `overrun`, which names both
/// ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

impl fmt::Display for Full {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the queue between the writing and the reading source is full; let the reader run as often as the writer, or bind asynchronously")
    }
}

impl std::error::Error for Full {}
