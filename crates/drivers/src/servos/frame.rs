// SPDX-License-Identifier: Apache-2.0
//! Common form of the two protocols of serial servos: a host requests, a servo answers, and each frame contains its length.

/// Maximum length of a frame of either protocol.
pub(super) const FRAME_MAX: usize = 512;
/// Id that addresses all servos; none of them answers.
pub(super) const BROADCAST: u8 = 0xfe;
/// Maximum id of a servo.
pub(super) const ID_MAX: u8 = 0xfc;

/// Request to a servo. Addresses are those of a servo's registers.
#[derive(Clone, Copy, Debug)]
pub(super) enum Ask<'a> {
    Ping,
    Read {
        address: u16,
        len: u16,
    },
    Write {
        address: u16,
        bytes: &'a [u8],
    },
    /// Reads from several servos: each answers with its own frame, in this order.
    SyncRead {
        address: u16,
        len: u16,
        ids: &'a [u8],
    },
    /// Writes to several servos, without an answer. `rows` has an id and `len` bytes for each servo.
    SyncWrite {
        address: u16,
        len: u16,
        rows: &'a [u8],
    },
    /// Restarts the servo, which clears its hardware error (Dynamixel only).
    Reboot,
}

/// Answer of a servo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Answer<'a> {
    pub(super) id: u8,
    /// Error field of the protocol: bits of Feetech, a number and an alert bit of Dynamixel.
    pub(super) error: u8,
    pub(super) bytes: &'a [u8],
}

/// Result of parsing the first bytes of a buffer.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum FrameScan<'a> {
    /// An answer of this number of bytes; `None`: a frame that is not an answer.
    Frame(usize, Option<Answer<'a>>),
    /// An incomplete frame.
    Part,
    /// Number of bytes that do not start a frame.
    Skip(usize),
    /// A frame whose checksum or length is wrong, and the number of bytes to skip.
    Bad(usize),
}

/// Bytes of a frame under construction. Nothing is allocated.
pub(super) struct Frame {
    bytes: [u8; FRAME_MAX],
    len: usize,
}

impl Frame {
    pub(super) const fn new() -> Frame {
        Frame { bytes: [0; FRAME_MAX], len: 0 }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends bytes; those that do not fit are left out, which [`Frame::is_whole`] reports.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        let end = (self.len + bytes.len()).min(FRAME_MAX);
        self.bytes[self.len..end].copy_from_slice(&bytes[..end - self.len]);
        self.len = end;
    }

    /// Returns true if everything that was appended fits.
    pub(super) fn is_whole(&self) -> bool {
        self.len < FRAME_MAX
    }

    /// Overwrites one byte that was appended before.
    pub(super) fn set(&mut self, at: usize, byte: u8) {
        self.bytes[at] = byte;
    }
}
