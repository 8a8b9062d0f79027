// SPDX-License-Identifier: Apache-2.0
//! The writing side of a connection or link: what is sent, and again where no answer came. No clock of its own, no wire: the caller
//! says what time it is and sends what it is given.
use interconnect::Header;
use interconnect::message::ends::WritingEnd;
use interconnect::message::packet::{Content, Repr};

/// Time without an answer after which something is sent again, ns.
const RETRANSMIT_NS: i64 = 50_000_000;
/// The same at most, after it was doubled again and again.
const RETRANSMIT_NS_MAX: i64 = 400_000_000;
/// A reader that has an older group is sent the newest at once, if that was not sent within this time.
const RECENT_NS: i64 = 20_000_000;
/// Rows that are sent again at a time: the first that are missing are what the reader waits for.
const AGAIN_ROWS: usize = 8;

/// Packets to send, in order.
pub(crate) type Packets = Vec<Vec<u8>>;

pub(crate) struct Outbound {
    connection: u64,
    end: WritingEnd,
    /// When the group, and when rows are sent again. Each has its own: answers to the one say nothing of the others.
    group: Due,
    rows: Due,
    group_sent_ns: i64,
    /// Rows before this one were sent again: those that are still missing follow as soon as there is news of them.
    again_until: u64,
}

/// Time at which something is sent again.
struct Due {
    /// None where all of it is known to have arrived.
    at_ns: Option<i64>,
    interval_ns: i64,
}

impl Due {
    fn new() -> Self {
        Due { at_ns: None, interval_ns: RETRANSMIT_NS }
    }

    /// Notes that something was sent.
    fn sent(&mut self, now_ns: i64) {
        self.at_ns.get_or_insert(now_ns + self.interval_ns);
    }

    /// Notes that there was an answer; more is on its way or not.
    fn answered(&mut self, waits: bool, now_ns: i64) {
        self.interval_ns = RETRANSMIT_NS;
        self.at_ns = waits.then_some(now_ns + self.interval_ns);
    }

    /// Returns true if it is to be sent again now; then less often.
    fn take(&mut self, waits: bool, now_ns: i64) -> bool {
        let due = self.at_ns.is_some_and(|at_ns| at_ns <= now_ns);
        if due {
            self.at_ns = waits.then_some(now_ns + self.interval_ns);
            self.interval_ns = (2 * self.interval_ns).min(RETRANSMIT_NS_MAX);
        }
        due && waits
    }
}

impl Outbound {
    pub(crate) fn new(connection: u64, depth: usize, window: usize) -> Self {
        let end = WritingEnd::new(depth, window);
        Outbound { connection, end, group: Due::new(), rows: Due::new(), group_sent_ns: i64::MIN, again_until: 0 }
    }

    pub(crate) fn publish(&mut self, header: Header, bytes: &[u8], now_ns: i64, out: &mut Packets) {
        self.end.publish(header, bytes);
        self.send_group(now_ns, out);
        self.group.sent(now_ns);
    }

    pub(crate) fn push(&mut self, number: u64, bytes: Vec<u8>, now_ns: i64, out: &mut Packets) {
        let sequence = self.end.push(number, bytes);
        self.send_rows(sequence, 1, out);
        self.rows.sent(now_ns);
    }

    pub(crate) fn has_room(&self) -> bool {
        self.end.has_room()
    }

    /// Returns the number of rows that may have been pushed in all, as far as is known.
    pub(crate) fn room_until(&self) -> u64 {
        self.end.room_until()
    }

    /// Returns true if everything is known to have arrived.
    pub(crate) fn is_idle(&self) -> bool {
        self.end.group().is_none() && !self.end.has_rows()
    }

    /// Takes a packet of the reading side; returns true if there may be room that was not there before.
    pub(crate) fn came(&mut self, content: Content<'_>, now_ns: i64, out: &mut Packets) -> bool {
        match content {
            Content::GroupReceived { sequence } => {
                self.end.group_received(sequence);
                if sequence < self.end.published() && now_ns.saturating_sub(self.group_sent_ns) > RECENT_NS {
                    self.send_group(now_ns, out);
                }
                self.group.answered(self.end.group().is_some(), now_ns);
                false
            }
            Content::RowsReceived { count } => {
                let news = self.end.rows_received(count);
                if news {
                    self.rows.answered(self.end.has_rows(), now_ns);
                    if self.end.received() < self.again_until {
                        self.send_rows(0, AGAIN_ROWS, out);
                    }
                }
                news
            }
            Content::RowsPopped { count } => {
                let count = self.end.rows_popped(count);
                out.push(self.emit(Content::RoomKnown { count }));
                true
            }
            Content::Group { .. } | Content::Row { .. } | Content::RoomKnown { .. } => false,
        }
    }

    /// Sends again what had no answer for too long.
    pub(crate) fn tick(&mut self, now_ns: i64, out: &mut Packets) {
        if self.group.take(self.end.group().is_some(), now_ns) {
            self.send_group(now_ns, out);
        }
        if self.rows.take(self.end.has_rows(), now_ns) {
            self.send_rows_again(out);
        }
    }

    /// Sends again, at once, what is not known to have arrived: the way is whole again after a partition.
    pub(crate) fn again(&mut self, now_ns: i64, out: &mut Packets) {
        self.send_group(now_ns, out);
        self.group.answered(self.end.group().is_some(), now_ns);
        self.send_rows_again(out);
        self.rows.answered(self.end.has_rows(), now_ns);
    }

    fn send_rows_again(&mut self, out: &mut Packets) {
        self.again_until = self.end.pushed();
        self.send_rows(0, AGAIN_ROWS, out);
    }

    fn send_group(&mut self, now_ns: i64, out: &mut Packets) {
        if let Some(content) = self.end.group() {
            out.push(self.emit(content));
            self.group_sent_ns = now_ns;
        }
    }

    fn send_rows(&self, sequence: u64, count: usize, out: &mut Packets) {
        out.extend(self.end.rows(sequence).take(count).map(|content| self.emit(content)));
    }

    fn emit(&self, content: Content<'_>) -> Vec<u8> {
        Repr { connection: self.connection, content }.emit()
    }
}
