// SPDX-License-Identifier: Apache-2.0
//! The two protocols of serial servos, chosen by the kind of driver.
use super::frame::{Ask, FRAME_MAX, Frame, FrameScan};
use super::{dynamixel2, sts};

/// A protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Protocol {
    /// Feetech STS: a sum over each frame; numbers with a sign bit.
    Sts,
    /// Dynamixel 2.0: a CRC over each frame, in which headers are stuffed; numbers in two's complement.
    Dynamixel,
}

impl Protocol {
    /// Writes a frame. False where it does not fit, or the protocol has no such request.
    pub(super) fn write(self, frame: &mut Frame, id: u8, ask: Ask<'_>) -> bool {
        frame.clear();
        let known = match self {
            Protocol::Sts => sts::write(frame, id, ask),
            Protocol::Dynamixel => dynamixel2::write(frame, id, ask),
        };
        known && frame.is_whole()
    }

    /// Reads the frame at the beginning of a buffer. `scratch` takes what was stuffed.
    pub(super) fn take<'a>(self, bytes: &'a [u8], scratch: &'a mut [u8; FRAME_MAX]) -> FrameScan<'a> {
        match self {
            Protocol::Sts => sts::take(bytes),
            Protocol::Dynamixel => dynamixel2::take(bytes, scratch),
        }
    }

    /// Bytes of an answer that carries `len`, where nothing is stuffed.
    pub(super) const fn answer_len(self, len: usize) -> usize {
        match self {
            Protocol::Sts => 6 + len,
            Protocol::Dynamixel => 11 + len,
        }
    }
}
