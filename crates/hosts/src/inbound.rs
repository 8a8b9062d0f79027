// SPDX-License-Identifier: Apache-2.0
//! Reading side of a connection or link: tracks received packets and creates the answers. Like [`crate::outbound`], it uses neither a
//! clock nor a wire.
use crate::outbound::Packets;
use interconnect::Header;
use interconnect::message::ends::ReadingEnd;
use interconnect::message::packet::{Content, Repr};

/// Time without an answer after which the available space is reported again, and a reader that has received nothing repeats its request,
/// ns.
const ASK_NS: i64 = 50_000_000;
/// Maximum interval between a reader's requests, reached after repeated requests without an answer, ns.
const ASK_NS_MAX: i64 = 1_000_000_000;

pub(crate) struct Inbound {
    connection: u64,
    end: ReadingEnd,
    window: u64,
    /// True if a group still has to be acknowledged; `rows_owed` is the number of rows that still have to be acknowledged.
    group_owed: bool,
    rows_owed: u64,
    /// Available space that was last reported, and the time of the report.
    told: (u64, i64),
    /// Time at which the reader requests the current state; `None` once a packet has arrived.
    ask_ns: Option<i64>,
    ask_interval_ns: i64,
}

impl Inbound {
    /// Creates an end for groups of a fixed length and rows of a fixed length (any length if `None`), with at most `window` rows in
    /// transit.
    pub(crate) fn new(connection: u64, group_len: usize, row_len: Option<usize>, window: usize) -> Self {
        let end = ReadingEnd::new(group_len, row_len);
        Inbound {
            connection,
            end,
            window: window as u64,
            group_owed: false,
            rows_owed: 0,
            told: (0, i64::MIN),
            ask_ns: Some(i64::MIN),
            ask_interval_ns: ASK_NS,
        }
    }

    /// Handles a packet from the writing side. Returns a publication if it is newer than all previous ones. Corrupted, late or repeated
    /// packets have no effect.
    pub(crate) fn came(&mut self, content: Content<'_>, out: &mut Packets) -> Option<(Header, Vec<u8>)> {
        match content {
            Content::Group { sequence, header, bytes } => {
                self.end.group_came(sequence, header, bytes)?;
                self.ask_ns = None;
                self.group_owed = true;
            }
            Content::Row { sequence, number, bytes } => {
                // No writer has more rows in transit, so no packet can make this end store more.
                if sequence >= self.end.received() + self.window {
                    return None;
                }
                self.end.row_came(sequence, number, bytes)?;
                self.ask_ns = None;
                self.rows_owed += 1;
                if self.rows_owed * 4 >= self.window {
                    self.answer_rows(out);
                }
            }
            Content::RoomKnown { count } => self.end.room_known(count),
            Content::GroupReceived { .. } | Content::RowsReceived { .. } | Content::RowsPopped { .. } => {}
        }
        self.end.latch()
    }

    /// Removes and returns the oldest row.
    pub(crate) fn take(&mut self) -> Option<(u64, Vec<u8>)> {
        self.end.take()
    }

    /// Returns the number and bytes of the oldest row without removing it.
    pub(crate) fn oldest(&self) -> Option<&(u64, Vec<u8>)> {
        self.end.oldest()
    }

    /// Records that the reader has popped a total of `count` of the rows that were taken.
    pub(crate) fn popped(&mut self, count: u64) {
        self.end.popped(count);
    }

    /// Returns the number of rows that have arrived but have not been popped.
    pub(crate) fn waiting(&self) -> u64 {
        self.end.waiting()
    }

    /// Sends the answers that are due. One answer covers many packets, so that the return path is less busy than the forward path.
    pub(crate) fn tick(&mut self, now_ns: i64, out: &mut Packets) {
        if self.ask_ns.is_some_and(|ask_ns| ask_ns <= now_ns) {
            self.ask_ns = Some(now_ns + self.ask_interval_ns);
            self.ask_interval_ns = (2 * self.ask_interval_ns).min(ASK_NS_MAX);
            (self.group_owed, self.rows_owed) = (true, 1);
        }
        if std::mem::take(&mut self.group_owed) {
            out.push(self.emit(Content::GroupReceived { sequence: self.end.newest() }));
        }
        if self.rows_owed > 0 {
            self.answer_rows(out);
        }
        self.tell_room(now_ns, out);
    }

    /// Reports the received state immediately, so that the writing side sends anything newer, for example after a partition.
    pub(crate) fn ask(&mut self, now_ns: i64, out: &mut Packets) {
        (self.group_owed, self.rows_owed) = (true, 1);
        self.tick(now_ns, out);
    }

    /// Reports how many rows were popped, unless the other side has acknowledged that number.
    pub(crate) fn tell_room(&mut self, now_ns: i64, out: &mut Packets) {
        let Some(content @ Content::RowsPopped { count }) = self.end.room_news() else { return };
        let (told, told_ns) = self.told;
        if count > told || now_ns.saturating_sub(told_ns) > ASK_NS {
            self.told = (count, now_ns);
            out.push(self.emit(content));
        }
    }

    fn answer_rows(&mut self, out: &mut Packets) {
        self.rows_owed = 0;
        out.push(self.emit(Content::RowsReceived { count: self.end.received() }));
    }

    fn emit(&self, content: Content<'_>) -> Vec<u8> {
        Repr { connection: self.connection, content }.emit()
    }
}
