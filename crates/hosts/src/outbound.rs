// SPDX-License-Identifier: Apache-2.0
//! Writing side of a connection or link: sends packets, and retransmits them if they are not answered. It uses neither a clock nor a
//! wire: the caller passes the time and sends the created packets.
use interconnect::Header;
use interconnect::message::ends::WritingEnd;
use interconnect::message::packet::{Content, Repr};

/// Time without an answer after which a packet is retransmitted, ns.
const RETRANSMIT_NS: i64 = 50_000_000;
/// Maximum retransmission timeout, reached after repeated doubling, ns.
const RETRANSMIT_NS_MAX: i64 = 400_000_000;
/// Time after sending the newest group during which it is not sent again to a reader that reports an older one, ns.
const RECENT_NS: i64 = 20_000_000;
/// Number of rows retransmitted at a time. It is small, because the reader waits only for the first missing rows.
const AGAIN_ROWS: usize = 8;

/// Packets to send, in order.
pub(crate) type Packets = Vec<Vec<u8>>;

pub(crate) struct Outbound {
    connection: u64,
    end: WritingEnd,
    /// Retransmission timers of the group and of the rows. They are separate because answers to one do not acknowledge the other.
    group: Due,
    rows: Due,
    group_sent_ns: i64,
    /// Rows below this number were retransmitted; those still missing are retransmitted as soon as an answer reports them.
    again_until: u64,
}

/// Retransmission timer.
struct Due {
    /// Time at which a retransmission is due; `None` if everything is acknowledged.
    at_ns: Option<i64>,
    interval_ns: i64,
}

impl Due {
    fn new() -> Self {
        Due { at_ns: None, interval_ns: RETRANSMIT_NS }
    }

    /// Records that a packet was sent.
    fn sent(&mut self, now_ns: i64) {
        self.at_ns.get_or_insert(now_ns + self.interval_ns);
    }

    /// Records an answer; `waits` is true if packets are still unacknowledged.
    fn answered(&mut self, waits: bool, now_ns: i64) {
        self.interval_ns = RETRANSMIT_NS;
        self.at_ns = waits.then_some(now_ns + self.interval_ns);
    }

    /// Returns true if a retransmission is due now; subsequent ones become less frequent.
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

    /// Returns the total number of rows that may have been pushed, as far as this side knows.
    pub(crate) fn room_until(&self) -> u64 {
        self.end.room_until()
    }

    /// Returns true if everything is acknowledged.
    pub(crate) fn is_idle(&self) -> bool {
        self.end.group().is_none() && !self.end.has_rows()
    }

    /// Handles a packet from the reading side; returns true if more space may be available.
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

    /// Retransmits packets that have not been answered for too long.
    pub(crate) fn tick(&mut self, now_ns: i64, out: &mut Packets) {
        if self.group.take(self.end.group().is_some(), now_ns) {
            self.send_group(now_ns, out);
        }
        if self.rows.take(self.end.has_rows(), now_ns) {
            self.send_rows_again(out);
        }
    }

    /// Retransmits all unacknowledged packets immediately, because the connection works again after a partition.
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
