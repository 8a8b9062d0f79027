// SPDX-License-Identifier: Apache-2.0
//! Common format of the two protocols of serial servos: a host requests, a servo answers, and each frame contains its length.

/// Maximum length of a frame of either protocol.
pub(super) const FRAME_MAX: usize = 512;
/// ID that addresses all servos; none of them answers.
pub(super) const BROADCAST: u8 = 0xfe;
/// Maximum ID of a servo.
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
    /// Reads from several servos; each answers with its own frame, in this order.
    SyncRead {
        address: u16,
        len: u16,
        ids: &'a [u8],
    },
    /// Writes to several servos, which do not answer. `rows` contains an ID and `len` bytes for each servo.
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
    /// Error field of the protocol: error bits for Feetech, a number and an alert bit for Dynamixel.
    pub(super) error: u8,
    pub(super) bytes: &'a [u8],
}

/// Result of parsing the first bytes of a buffer.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum FrameScan<'a> {
    /// A complete frame: its length in bytes, and the answer it contains; `None` if it is not an answer (an echo, for example).
    Frame(usize, Option<Answer<'a>>),
    /// The beginning of an incomplete frame.
    Part,
    /// Bytes that do not start a frame, with their number.
    Skip(usize),
    /// A frame with a wrong checksum or length, with the number of bytes to skip.
    Bad(usize),
}

/// A frame under construction. Does not allocate.
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

    /// Appends bytes. Bytes that do not fit are dropped; [`Frame::is_whole`] reports this.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        let end = (self.len + bytes.len()).min(FRAME_MAX);
        self.bytes[self.len..end].copy_from_slice(&bytes[..end - self.len]);
        self.len = end;
    }

    /// Returns true if all appended bytes fitted.
    pub(super) fn is_whole(&self) -> bool {
        self.len < FRAME_MAX
    }

    /// Overwrites a byte that was appended earlier.
    pub(super) fn set(&mut self, at: usize, byte: u8) {
        self.bytes[at] = byte;
    }
}
