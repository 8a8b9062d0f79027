// SPDX-License-Identifier: Apache-2.0
//! Connections over messages: an in-memory link that can delay, drop, repeat, reorder and corrupt packets, for tests under the virtual
//! clock.
//!
//! Publications and rows become packets with a checksum. Whatever the faults, the reader eventually receives the newest group, never an
//! older one after a newer one, and never a damaged one; it also receives every row, in order, exactly once. The same seed and calls give
//! the same deliveries. The link has no clock, so time advances only with the calls. Each end is behind a single lock, so it is not for
//! the real-time path.
pub mod ends;
mod link;
pub mod packet;
mod traffic;

pub use link::{Counters, Faults};
#[doc(hidden)]
pub use packet::sealed;

use crate::aligned::AlignedBytes;
use crate::carrier::{Carrier, ConnectionSpec, Full, Header, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use traffic::Traffic;

/// Carrier over one faulty link. A clone shares the link, so that a test can keep one to read the counters.
#[derive(Clone)]
pub struct Message(Arc<Mutex<Traffic>>);

impl Message {
    /// Creates a link whose faults are determined by `seed`. Panics if a field of `faults` is out of its range.
    pub fn new(seed: u64, faults: Faults) -> Self {
        Message(Arc::new(Mutex::new(Traffic::new(seed, faults))))
    }

    /// Returns the counters of packet events so far.
    pub fn counters(&self) -> Counters {
        self.traffic().link.counters
    }

    /// Changes the faults. Packets in transit are not affected, and connections keep their window.
    pub fn set_faults(&self, faults: Faults) {
        faults.check();
        self.traffic().link.faults = faults;
    }

    /// Delivers `bytes`, a forged packet, to one end of connection `connection` (numbered from 0 in order of creation). Returns true if
    /// it was accepted. For tests of packet parsing.
    #[doc(hidden)]
    pub fn arrive(&self, connection: u32, to_reader: bool, bytes: &[u8]) -> bool {
        self.traffic().arrive(connection, to_reader, bytes).is_ok()
    }

    fn traffic(&self) -> MutexGuard<'_, Traffic> {
        // State left by a panic elsewhere is no worse than a fault of the link.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Carrier for Message {
    fn connect(&mut self, spec: &ConnectionSpec) -> (Box<dyn Sender>, Box<dyn Receiver>) {
        let connection = self.traffic().connect(spec);
        let group = AlignedBytes::new(spec.asynchronous_len);
        let row_len = (spec.queue_depth > 0).then_some(spec.queue_row_len);
        let sender = MessageSender { link: self.clone(), connection, group, row_len, arrived: true };
        let (group, row) = (AlignedBytes::new(spec.asynchronous_len), AlignedBytes::new(spec.queue_row_len));
        (Box::new(sender), Box::new(MessageReceiver { link: self.clone(), connection, group, row, peeked: None }))
    }

    fn next_arrival(&self) -> Option<i64> {
        self.traffic().next()
    }

    fn deliver(&mut self, now_ns: i64, raise: &mut dyn FnMut(u32)) {
        let raises = {
            let mut traffic = self.traffic();
            traffic.run_until(now_ns);
            traffic.take_raises()
        };
        // The lock has been released, because a raised source may publish.
        raises.into_iter().for_each(raise);
    }
}

/// Fill value that exposes a writer that does not fill its whole group or row.
const SPOILT: u8 = 0xa5;

struct MessageSender {
    link: Message,
    connection: u32,
    group: AlignedBytes,
    /// Length of a row; `None` without a queue.
    row_len: Option<usize>,
    arrived: bool,
}

impl Sender for MessageSender {
    fn group(&mut self) -> &mut [u8] {
        self.group.bytes_mut()
    }

    fn publish(&mut self, number: u64, now_ns: i64) {
        self.link.traffic().publish(self.connection, Header { number, time_ns: now_ns }, self.group.bytes());
        self.group.bytes_mut().fill(SPOILT);
    }

    fn push(&mut self, number: u64, now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        let row_len = self.row_len.expect("rows are pushed only into a connection that was made with a queue");
        if !self.link.traffic().room_at(self.connection, now_ns) {
            return Err(Full);
        }
        let mut row = vec![SPOILT; row_len];
        fill(&mut row);
        self.arrived = self.link.traffic().push(self.connection, number, now_ns, row);
        Ok(())
    }

    fn arrived(&self) -> bool {
        self.arrived
    }
}

impl Drop for MessageSender {
    fn drop(&mut self) {
        self.link.traffic().drop_writing(self.connection);
    }
}

struct MessageReceiver {
    link: Message,
    connection: u32,
    group: AlignedBytes,
    /// Copy of the oldest row, with its number, once it has been peeked at.
    row: AlignedBytes,
    peeked: Option<u64>,
}

impl Receiver for MessageReceiver {
    fn latch(&mut self, now_ns: i64) -> Option<Header> {
        let mut traffic = self.link.traffic();
        traffic.run_until(now_ns);
        let (header, bytes) = traffic.reading(self.connection).latch()?;
        self.group.bytes_mut().copy_from_slice(&bytes);
        Some(header)
    }

    fn group(&self) -> &[u8] {
        self.group.bytes()
    }

    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        if self.peeked.is_none() {
            let mut traffic = self.link.traffic();
            let (number, bytes) = traffic.reading(self.connection).oldest()?;
            self.row.bytes_mut().copy_from_slice(bytes);
            self.peeked = Some(*number);
        }
        self.peeked.map(|number| (number, self.row.bytes()))
    }

    fn pop_row(&mut self) -> bool {
        self.peeked = None;
        self.link.traffic().pop(self.connection)
    }

    fn rows(&self) -> usize {
        self.link.traffic().reading(self.connection).ready()
    }
}

impl Drop for MessageReceiver {
    fn drop(&mut self) {
        self.link.traffic().drop_reading(self.connection);
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    const SPEC: ConnectionSpec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 4, queue_row_len: 4, queue_depth: 2 };

    fn settle(link: &mut Message) {
        for _ in 0..1_000 {
            let Some(at_ns) = link.next_arrival() else { return };
            link.deliver(at_ns, &mut |_| ());
        }
        panic!("the link does not come to rest");
    }

    #[test]
    fn what_a_cut_link_lost_arrives_when_it_is_whole_again() {
        let mut link = Message::new(1, Faults::delay(100, 200));
        let (mut sender, mut receiver) = link.connect(&SPEC);
        link.set_faults(Faults { drop: 1.0, ..Faults::delay(100, 200) });
        sender.group().fill(1);
        sender.publish(1, 0);
        assert_eq!(sender.push(1, 0, &mut |row| row.fill(1)), Ok(()));
        link.deliver(10_000, &mut |_| panic!("nothing arrives over a cut link"));
        assert_eq!((receiver.latch(10_000), receiver.rows()), (None, 0));
        assert!(link.counters().retransmitted > 10);

        link.set_faults(Faults::delay(100, 200));
        settle(&mut link);
        assert_eq!(receiver.latch(20_000), Some(Header { number: 1, time_ns: 0 }));
        assert_eq!(receiver.peek_row(), Some((1, [1; 4].as_slice())));
    }

    #[test]
    fn a_link_that_is_not_faulty_sends_nothing_twice() {
        let mut link = Message::new(1, Faults::delay(100, 200));
        let (mut sender, mut receiver) = link.connect(&SPEC);
        for number in 0..10 {
            sender.publish(number, number as i64 * 10_000);
            assert_eq!(sender.push(number, number as i64 * 10_000, &mut |row| row.fill(1)), Ok(()));
            settle(&mut link);
            assert!(receiver.pop_row());
            settle(&mut link);
        }
        // Each publication and row with its answer, and the notice of room for another row with its answer.
        assert_eq!(link.counters(), Counters { sent: 60, delivered: 60, ..Counters::default() });
    }

    #[test]
    fn a_writer_that_leaves_bytes_of_its_group_out_is_found() {
        let mut link = Message::new(1, Faults::none());
        let (mut sender, mut receiver) = link.connect(&SPEC);
        sender.group().fill(1);
        sender.publish(1, 0);
        sender.group()[..2].fill(1);
        sender.publish(2, 0);
        assert!(receiver.latch(0).is_some());
        assert_eq!(receiver.group(), [1, 1, SPOILT, SPOILT]);
    }

    #[test]
    fn a_publication_with_a_time_before_the_links_own_leaves_now() {
        let mut link = Message::new(1, Faults::delay(100, 100));
        let (mut sender, _receiver) = link.connect(&SPEC);
        link.deliver(5_000, &mut |_| ());
        sender.publish(1, 1_000);
        assert_eq!(link.next_arrival(), Some(5_100), "nothing arrives in the past");

        let mut link = Message::new(1, Faults::none());
        let (mut sender, mut receiver) = link.connect(&SPEC);
        link.deliver(5_000, &mut |_| ());
        sender.group().fill(1);
        sender.publish(1, 1_000);
        assert_eq!(receiver.latch(1_000), Some(Header { number: 1, time_ns: 1_000 }));
        assert_eq!(link.next_arrival(), None);
    }

    #[test]
    fn connections_that_are_gone_leave_nothing() {
        let mut link = Message::new(1, Faults::every());
        for round in 0..1_000 {
            let (mut sender, receiver) = link.connect(&SPEC);
            sender.publish(round, round as i64);
            assert_eq!(sender.push(round, round as i64, &mut |row| row.fill(1)), Ok(()));
            if round % 2 == 0 {
                drop(receiver);
                drop(sender);
            }
        }
        assert!(link.traffic().is_empty());
        assert_eq!(link.next_arrival(), None);
    }
}
