// SPDX-License-Identifier: Apache-2.0
//! Protocols of serial servos, selected by the kind of driver.
use super::frame::{Ask, FRAME_MAX, Frame, FrameScan};
use super::{dynamixel2, sts};

/// Protocol of a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Protocol {
    /// Feetech STS: a checksum over each frame; sign-magnitude numbers.
    Sts,
    /// Dynamixel 2.0: a CRC over each frame, with byte stuffing; numbers in two's complement.
    Dynamixel,
}

impl Protocol {
    /// Writes a frame; returns false if the frame does not fit, or the protocol has no such request.
    pub(super) fn write(self, frame: &mut Frame, id: u8, ask: Ask<'_>) -> bool {
        frame.clear();
        let known = match self {
            Protocol::Sts => sts::write(frame, id, ask),
            Protocol::Dynamixel => dynamixel2::write(frame, id, ask),
        };
        known && frame.is_whole()
    }

    /// Parses the frame at the start of a buffer. `scratch` receives its bytes with the stuffing removed.
    pub(super) fn take<'a>(self, bytes: &'a [u8], scratch: &'a mut [u8; FRAME_MAX]) -> FrameScan<'a> {
        match self {
            Protocol::Sts => sts::take(bytes),
            Protocol::Dynamixel => dynamixel2::take(bytes, scratch),
        }
    }

    /// Returns the length of an answer with `len` bytes of data, excluding stuffing.
    pub(super) const fn answer_len(self, len: usize) -> usize {
        match self {
            Protocol::Sts => 6 + len,
            Protocol::Dynamixel => 11 + len,
        }
    }
}
