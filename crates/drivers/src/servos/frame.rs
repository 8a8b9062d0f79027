// SPDX-License-Identifier: Apache-2.0
//! Common form of the two protocols of serial servos: a host asks, a servo answers, and each frame says where it ends.

/// The longest frame of either protocol that is sent or taken.
pub(super) const FRAME_MAX: usize = 512;
/// The servo that everyone is: nobody answers.
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
    /// Reads of several servos: each answers with its own frame, in this order.
    SyncRead {
        address: u16,
        len: u16,
        ids: &'a [u8],
    },
    /// Writes to several servos: there is no answer. `rows`: an id and `len` bytes for each servo.
    SyncWrite {
        address: u16,
        len: u16,
        rows: &'a [u8],
    },
    /// Dynamixel only: restarts the servo, which forgets its hardware error.
    Reboot,
}

/// The answer of a servo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Answer<'a> {
    pub(super) id: u8,
    /// Error field of the protocol: bits of Feetech, a number and an alert bit of Dynamixel.
    pub(super) error: u8,
    pub(super) bytes: &'a [u8],
}

/// Result of reading the first bytes of a buffer.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum FrameScan<'a> {
    /// An answer of so many bytes; `None`: a frame that is no answer.
    Frame(usize, Option<Answer<'a>>),
    /// A frame that has not come whole.
    Part,
    /// So many bytes that begin no frame.
    Skip(usize),
    /// A frame whose checksum or length is wrong; so many bytes of it are left out.
    Bad(usize),
}

/// Bytes of a frame that is being written. Nothing is allocated.
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

    /// Appends bytes; what does not fit is left out, which [`Frame::is_whole`] tells.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        let end = (self.len + bytes.len()).min(FRAME_MAX);
        self.bytes[self.len..end].copy_from_slice(&bytes[..end - self.len]);
        self.len = end;
    }

    /// Returns true if everything that was appended fits.
    pub(super) fn is_whole(&self) -> bool {
        self.len < FRAME_MAX
    }

    /// Stores one byte that was appended before.
    pub(super) fn set(&mut self, at: usize, byte: u8) {
        self.bytes[at] = byte;
    }
}
