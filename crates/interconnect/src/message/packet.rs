// SPDX-License-Identifier: Apache-2.0
//! Packets on the message link, and between hosts: a checked view of bytes, [`Packet`], and its content, [`Repr`].
//!
//! | bytes | field |
//! |---|---|
//! | 0..8 | [`checksum`] of all bytes after it |
//! | 8..12 | length of the packet |
//! | 12..16 | kind |
//! | 16..24 | connection |
//! | 24..32 | sequence number, or a count |
//! | 32..40 | number |
//! | 40..48 | time, ns |
//! | 48.. | the group or the row |
//!
//! All fields are little-endian. A field that a kind does not use is zero.
use crate::carrier::Header;

/// Bytes whose length and checksum have been verified.
#[derive(Clone, Copy, Debug)]
pub struct Packet<'a>(&'a [u8]);

impl<'a> Packet<'a> {
    /// Checks the length and the checksum.
    ///
    /// # Errors
    /// [`DamagedPacket`] if one of them does not match.
    pub fn new_checked(bytes: &'a [u8]) -> Result<Self, DamagedPacket> {
        if bytes.len() < PAYLOAD || word(bytes, LENGTH) as u32 as usize != bytes.len() {
            return Err(DamagedPacket);
        }
        if word(bytes, 0) != checksum(&bytes[CHECKED..]) {
            return Err(DamagedPacket);
        }
        Ok(Packet(bytes))
    }

    fn kind(self) -> u32 {
        (word(self.0, LENGTH) >> 32) as u32
    }
}

/// Error: the bytes are not an intact packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DamagedPacket;

/// Content of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repr<'a> {
    /// Number of the connection, unique among the connections that share the link.
    pub connection: u64,
    /// Content, which depends on the kind of packet.
    pub content: Content<'a>,
}

/// Kinds of packets, sent from the writing end to the reading end unless stated otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content<'a> {
    /// Publication `sequence` (from 1) of the group.
    Group {
        /// Number of the publication, from 1.
        sequence: u64,
        /// Number and time of the publication.
        header: Header,
        /// Bytes of the group.
        bytes: &'a [u8],
    },
    /// To the writing end: publication `sequence` has arrived; older publications are no longer needed.
    GroupReceived {
        /// Newest publication that has arrived.
        sequence: u64,
    },
    /// Row `sequence` (from 0).
    Row {
        /// Number of the row, from 0.
        sequence: u64,
        /// Number assigned by the writer.
        number: u64,
        /// Bytes of the row.
        bytes: &'a [u8],
    },
    /// To the writing end: the first `count` rows have all arrived.
    RowsReceived {
        /// Number of rows that arrived in order.
        count: u64,
    },
    /// To the writing end: the reader has popped `count` rows, which frees their space.
    RowsPopped {
        /// Number of popped rows.
        count: u64,
    },
    /// Acknowledges that `count` rows were popped.
    RoomKnown {
        /// Number of popped rows.
        count: u64,
    },
}

impl<'a> Repr<'a> {
    /// Returns the content of the packet.
    ///
    /// # Errors
    /// [`DamagedPacket`] if its kind is unknown.
    pub fn parse(packet: Packet<'a>) -> Result<Self, DamagedPacket> {
        let (sequence, number, bytes) = (word(packet.0, SEQUENCE), word(packet.0, NUMBER), &packet.0[PAYLOAD..]);
        let content = match packet.kind() {
            1 => Content::Group { sequence, header: Header { number, time_ns: word(packet.0, TIME).cast_signed() }, bytes },
            2 => Content::GroupReceived { sequence },
            3 => Content::Row { sequence, number, bytes },
            4 => Content::RowsReceived { count: sequence },
            5 => Content::RowsPopped { count: sequence },
            6 => Content::RoomKnown { count: sequence },
            _ => return Err(DamagedPacket),
        };
        Ok(Repr { connection: word(packet.0, CONNECTION), content })
    }

    /// Returns the packet with this content.
    pub fn emit(&self) -> Vec<u8> {
        let (kind, sequence, number, time_ns, payload): (u32, u64, u64, i64, &[u8]) = match self.content {
            Content::Group { sequence, header, bytes } => (1, sequence, header.number, header.time_ns, bytes),
            Content::GroupReceived { sequence } => (2, sequence, 0, 0, &[]),
            Content::Row { sequence, number, bytes } => (3, sequence, number, 0, bytes),
            Content::RowsReceived { count } => (4, count, 0, 0, &[]),
            Content::RowsPopped { count } => (5, count, 0, 0, &[]),
            Content::RoomKnown { count } => (6, count, 0, 0, &[]),
        };
        let mut head = [0; PAYLOAD - CONTENT];
        head[..4].copy_from_slice(&kind.to_le_bytes());
        for (field, word) in head[4..].chunks_exact_mut(8).zip([self.connection, sequence, number, time_ns.cast_unsigned()]) {
            field.copy_from_slice(&word.to_le_bytes());
        }
        sealed_parts(&[&head, payload])
    }

    /// Returns true for a packet that is sent to the writing end.
    pub fn answers(&self) -> bool {
        matches!(self.content, Content::GroupReceived { .. } | Content::RowsReceived { .. } | Content::RowsPopped { .. })
    }
}

/// Returns the packet with the given content (all bytes after the length field), with length and checksum added.
#[doc(hidden)]
pub fn sealed(content: &[u8]) -> Vec<u8> {
    sealed_parts(&[content])
}

/// Seals several parts as [`sealed`] does, so that a group is copied into its packet only once.
fn sealed_parts(parts: &[&[u8]]) -> Vec<u8> {
    let len = CONTENT + parts.iter().map(|part| part.len()).sum::<usize>();
    let mut bytes = Vec::with_capacity(len);
    bytes.resize(CHECKED, 0);
    bytes.extend_from_slice(&u32::try_from(len).expect("groups and rows are far below 4 GiB").to_le_bytes());
    parts.iter().for_each(|part| bytes.extend_from_slice(part));
    let sum = checksum(&bytes[CHECKED..]);
    bytes[..CHECKED].copy_from_slice(&sum.to_le_bytes());
    bytes
}

const CHECKED: usize = 8;
const LENGTH: usize = 8;
const CONTENT: usize = 12;
const CONNECTION: usize = 16;
const SEQUENCE: usize = 24;
const NUMBER: usize = 32;
const TIME: usize = 40;
const PAYLOAD: usize = 48;

fn word(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes were cut out"))
}

/// Computes a checksum similar to FNV-1a, but over eight bytes at a time and with a rotation so that every bit affects every other. It
/// detects every change confined to eight bytes that start at a multiple of eight, and all but one in 2^64 of other changes.
pub fn checksum(bytes: &[u8]) -> u64 {
    let step = |sum: u64, word: u64| (sum ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    let mut words = bytes.chunks_exact(8);
    let sum = words.by_ref().fold(0xcbf2_9ce4_8422_2325 ^ bytes.len() as u64, |sum, eight| step(sum, word(eight, 0)));
    let mut rest = [0; 8];
    rest[..words.remainder().len()].copy_from_slice(words.remainder());
    step(sum, u64::from_le_bytes(rest))
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    const HEADER: Header = Header { number: 11, time_ns: -5 };

    fn all() -> Vec<Repr<'static>> {
        [
            Content::Group { sequence: 3, header: HEADER, bytes: b"group" },
            Content::Group { sequence: 4, header: HEADER, bytes: b"" },
            Content::GroupReceived { sequence: 3 },
            Content::Row { sequence: 0, number: u64::MAX, bytes: b"row" },
            Content::RowsReceived { count: 1 },
            Content::RowsPopped { count: 2 },
            Content::RoomKnown { count: 2 },
        ]
        .map(|content| Repr { connection: 77, content })
        .to_vec()
    }

    #[test]
    fn what_was_said_is_heard() {
        for repr in all() {
            let bytes = repr.emit();
            assert_eq!(Packet::new_checked(&bytes).and_then(Repr::parse), Ok(repr));
        }
    }

    #[test]
    fn a_changed_bit_or_a_cut_end_is_found() {
        for repr in all() {
            let bytes = repr.emit();
            for bit in 0..bytes.len() * 8 {
                let mut changed = bytes.clone();
                changed[bit / 8] ^= 1 << (bit % 8);
                assert_eq!(Packet::new_checked(&changed).err(), Some(DamagedPacket), "{repr:?}, bit {bit}");
            }
            for len in 0..bytes.len() {
                assert_eq!(Packet::new_checked(&bytes[..len]).err(), Some(DamagedPacket), "{repr:?}, {len} bytes");
            }
        }
    }

    #[test]
    fn an_unknown_kind_is_refused() {
        let mut bytes = Repr { connection: 1, content: Content::GroupReceived { sequence: 1 } }.emit();
        bytes[LENGTH + 4] = 99;
        let sum = checksum(&bytes[CHECKED..]);
        bytes[..CHECKED].copy_from_slice(&sum.to_le_bytes());
        assert_eq!(Packet::new_checked(&bytes).and_then(Repr::parse), Err(DamagedPacket));
    }
}
