// SPDX-License-Identifier: Apache-2.0
//! Traffic of all connections over one link: arrivals and retransmissions, in order of time.
use super::ends::{ReadingEnd, WritingEnd};
use super::link::{Faults, Link};
use super::packet::{Content, DamagedPacket, Packet, Repr};
use crate::carrier::{ConnectionSpec, Header};
use std::collections::{BTreeMap, BTreeSet};

pub(super) struct Traffic {
    pub(super) link: Link,
    now_ns: i64,
    connections: BTreeMap<u32, Connection>,
    connections_made: u32,
    /// Deadlines, ordered by time, then by connection.
    deadlines: BTreeSet<(i64, u32, Retransmission)>,
    /// Reading sources to be raised because rows became readable.
    raises: Vec<u32>,
}

impl Traffic {
    pub(super) fn new(seed: u64, faults: Faults) -> Self {
        let (connections, deadlines) = (BTreeMap::new(), BTreeSet::new());
        Traffic { link: Link::new(seed, faults), now_ns: i64::MIN, connections, connections_made: 0, deadlines, raises: Vec::new() }
    }

    pub(super) fn connect(&mut self, spec: &ConnectionSpec) -> u32 {
        let connection = self.connections_made;
        self.connections_made = connection.checked_add(1).expect("no system lives to make 2^32 connections");
        let writing = WritingEnd::new(spec.queue_depth, self.link.faults.window);
        let reading = ReadingEnd::new(spec.asynchronous_len, Some(spec.queue_row_len));
        self.connections.insert(connection, Connection { reader: spec.reader, writing, reading, ends: 2, open: true, due_ns: [None; 3] });
        connection
    }

    pub(super) fn next(&self) -> Option<i64> {
        let raise_ns = (!self.raises.is_empty()).then_some(self.now_ns);
        raise_ns.into_iter().chain(self.next_event()).min()
    }

    /// Processes everything that is due by `now_ns`, each event at its own time. Time never runs backwards, even if a firing publishes
    /// with its release time after calls with later times have been made.
    pub(super) fn run_until(&mut self, now_ns: i64) {
        let now_ns = now_ns.max(self.now_ns);
        while let Some(at_ns) = self.next_event().filter(|at_ns| *at_ns <= now_ns) {
            self.now_ns = self.now_ns.max(at_ns);
            if let Some((_, (connection, to_reader), bytes)) = self.link.arrival(at_ns) {
                match self.arrive(connection, to_reader, &bytes) {
                    Ok(()) => self.link.counters.delivered += 1,
                    Err(DamagedPacket) => self.link.counters.refused += 1,
                }
            } else if let Some((_, connection, which)) = self.deadlines.pop_first() {
                self.connection(connection).due_ns[which as usize] = None;
                self.retransmit(connection, which);
            }
        }
        self.now_ns = now_ns;
    }

    /// Takes the sources to be raised, one entry for each row.
    pub(super) fn take_raises(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.raises)
    }

    pub(super) fn publish(&mut self, connection: u32, header: Header, bytes: &[u8]) {
        self.run_until(header.time_ns);
        let Some(open) = self.open(connection) else { return };
        open.writing.publish(header, bytes);
        self.send_group(connection);
        self.run_until(header.time_ns);
    }

    /// Returns true if a row may be pushed at `now_ns`.
    pub(super) fn room_at(&mut self, connection: u32, now_ns: i64) -> bool {
        self.run_until(now_ns);
        self.connection(connection).writing.has_room()
    }

    /// Sends a row; returns true if it became readable before the call returned, so that no raise is pending.
    pub(super) fn push(&mut self, connection: u32, number: u64, now_ns: i64, bytes: Vec<u8>) -> bool {
        let Some(open) = self.open(connection) else { return false };
        let sequence = open.writing.push(number, bytes);
        self.send_rows(connection, sequence);
        self.run_until(now_ns);
        let Connection { reader, reading, .. } = self.connection(connection);
        let (reader, received) = (*reader, reading.received());
        // A forged row has already raised the reader when it arrived.
        let raise = self.raises.iter().rposition(|raised| *raised == reader).filter(|_| received > sequence);
        raise.map(|raise| self.raises.remove(raise)).is_some()
    }

    pub(super) fn reading(&mut self, connection: u32) -> &mut ReadingEnd {
        &mut self.connection(connection).reading
    }

    pub(super) fn pop(&mut self, connection: u32) -> bool {
        let popped = self.reading(connection).pop();
        if popped {
            self.send_room(connection);
            self.run_until(self.now_ns);
        }
        popped
    }

    /// Returns true if no state of any connection is left.
    #[cfg(test)]
    pub(super) fn is_empty(&self) -> bool {
        self.connections.is_empty() && self.deadlines.is_empty() && self.link.is_empty()
    }

    /// Drops the writing end; rows and groups already sent still arrive.
    pub(super) fn drop_writing(&mut self, connection: u32) {
        self.drop_end(connection);
    }

    /// Drops the reading end; nothing is sent or received afterwards.
    pub(super) fn drop_reading(&mut self, connection: u32) {
        self.link.forget(connection);
        for which in Retransmission::ALL {
            self.arm(connection, which, false);
        }
        self.connection(connection).open = false;
        self.drop_end(connection);
    }

    fn drop_end(&mut self, connection: u32) {
        let ended = self.connection(connection);
        ended.ends -= 1;
        if ended.ends == 0 {
            self.connections.remove(&connection);
        }
    }

    fn next_event(&self) -> Option<i64> {
        let deadline_ns = self.deadlines.first().map(|(at_ns, ..)| *at_ns);
        deadline_ns.into_iter().chain(self.link.next_arrival()).min()
    }

    fn connection(&mut self, connection: u32) -> &mut Connection {
        self.connections.get_mut(&connection).expect("a connection lives as long as one of its ends")
    }

    /// Returns the connection, if its reading end exists.
    fn open(&mut self, connection: u32) -> Option<&mut Connection> {
        Some(self.connection(connection)).filter(|connection| connection.open)
    }

    /// Delivers a packet to the reading or the writing end.
    pub(super) fn arrive(&mut self, connection: u32, to_reader: bool, bytes: &[u8]) -> Result<(), DamagedPacket> {
        let repr = Repr::parse(Packet::new_checked(bytes)?)?;
        if repr.connection != u64::from(connection) || repr.answers() == to_reader {
            return Err(DamagedPacket);
        }
        let Connection { reader, writing, reading, .. } = self.connection(connection);
        match repr.content {
            Content::Group { sequence, header, bytes } => {
                let sequence = reading.group_came(sequence, header, bytes).ok_or(DamagedPacket)?;
                self.send(connection, Content::GroupReceived { sequence });
            }
            Content::GroupReceived { sequence } => {
                writing.group_received(sequence);
                let unanswered = writing.group().is_some();
                if !unanswered {
                    self.arm(connection, Retransmission::Group, false);
                }
            }
            Content::Row { sequence, number, bytes } => {
                let readable = reading.row_came(sequence, number, bytes).ok_or(DamagedPacket)?;
                let (reader, count) = (*reader, reading.received());
                self.raises.extend(std::iter::repeat_n(reader, readable));
                self.send(connection, Content::RowsReceived { count });
            }
            Content::RowsReceived { count } => {
                let (news, unanswered) = (writing.rows_received(count), writing.has_rows());
                if news {
                    self.arm(connection, Retransmission::Rows, unanswered);
                }
            }
            Content::RowsPopped { count } => {
                let count = writing.rows_popped(count);
                self.send(connection, Content::RoomKnown { count });
            }
            Content::RoomKnown { count } => {
                reading.room_known(count);
                let unanswered = reading.room_news().is_some();
                if !unanswered {
                    self.arm(connection, Retransmission::Room, false);
                }
            }
        }
        Ok(())
    }

    fn retransmit(&mut self, connection: u32, which: Retransmission) {
        let before = self.link.counters.sent;
        match which {
            Retransmission::Group => self.send_group(connection),
            Retransmission::Rows => self.send_rows(connection, 0),
            Retransmission::Room => self.send_room(connection),
        }
        self.link.counters.retransmitted += self.link.counters.sent - before;
    }

    fn send_group(&mut self, connection: u32) {
        let packet = self.connection(connection).writing.group().map(|content| Repr { connection: connection.into(), content }.emit());
        self.send_packets(connection, true, packet);
        self.arm(connection, Retransmission::Group, true);
    }

    /// Sends the unacknowledged rows from `sequence` on.
    fn send_rows(&mut self, connection: u32, sequence: u64) {
        let rows = self.connection(connection).writing.rows(sequence);
        let packets: Vec<_> = rows.map(|content| Repr { connection: connection.into(), content }.emit()).collect();
        self.send_packets(connection, true, packets);
        self.arm(connection, Retransmission::Rows, true);
    }

    fn send_room(&mut self, connection: u32) {
        if let Some(content) = self.connection(connection).reading.room_news() {
            self.send(connection, content);
        }
        self.arm(connection, Retransmission::Room, true);
    }

    fn send(&mut self, connection: u32, content: Content<'_>) {
        let repr = Repr { connection: connection.into(), content };
        self.send_packets(connection, !repr.answers(), [repr.emit()]);
    }

    fn send_packets(&mut self, connection: u32, to_reader: bool, packets: impl IntoIterator<Item = Vec<u8>>) {
        for packet in packets {
            self.link.send((connection, to_reader), self.now_ns, packet);
        }
    }

    /// Schedules the retransmission that follows a time without an answer, or cancels it.
    fn arm(&mut self, connection: u32, which: Retransmission, unanswered: bool) {
        let due_ns = unanswered.then(|| self.now_ns.saturating_add(self.link.faults.retransmit_ns));
        let before_ns = std::mem::replace(&mut self.connection(connection).due_ns[which as usize], due_ns);
        if let Some(before_ns) = before_ns {
            self.deadlines.remove(&(before_ns, connection, which));
        }
        if let Some(due_ns) = due_ns {
            self.deadlines.insert((due_ns, connection, which));
        }
    }
}

struct Connection {
    /// Source that reads from the connection.
    reader: u32,
    writing: WritingEnd,
    reading: ReadingEnd,
    /// Number of ends (0 to 2) that are still held.
    ends: u8,
    /// True if the reading end is still held.
    open: bool,
    /// Deadline of each retransmission.
    due_ns: [Option<i64>; 3],
}

/// Packet to retransmit if no answer arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Retransmission {
    Group,
    Rows,
    Room,
}

impl Retransmission {
    const ALL: [Retransmission; 3] = [Retransmission::Group, Retransmission::Rows, Retransmission::Room];
}
