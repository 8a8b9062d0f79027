// SPDX-License-Identifier: Apache-2.0
//! Messages in a node's frames, according to the predefined connection set of CiA 301.
use crate::frame::Frame;
use crate::nmt::NodeState;

/// Message from a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message<'a> {
    /// Report of an error, or, with code 0, of its end.
    Emergency {
        node: u8,
        code: u16,
    },
    /// Process data, PDO 1 to 4.
    Pdo {
        node: u8,
        number: u8,
        bytes: &'a [u8],
    },
    /// Answer of the node's SDO server.
    Sdo {
        node: u8,
        bytes: [u8; 8],
    },
    Heartbeat {
        node: u8,
        state: NodeState,
    },
}

/// Parses a frame; returns `None` if it is not one of these messages or has the wrong length. Real-time safe.
pub fn read(frame: &Frame) -> Option<Message<'_>> {
    let node = (frame.id & 0x7F) as u8;
    let bytes = frame.bytes();
    if node == 0 {
        return None;
    }
    match (frame.id & 0x780, bytes) {
        (0x080, [low, high, _, _, _, _, _, _]) => Some(Message::Emergency { node, code: u16::from_le_bytes([*low, *high]) }),
        (function @ (0x180 | 0x280 | 0x380 | 0x480), bytes) => Some(Message::Pdo { node, number: (function >> 8) as u8, bytes }),
        (0x580, bytes) => bytes.try_into().ok().map(|bytes| Message::Sdo { node, bytes }),
        // The most significant bit is that of node guarding, which is not used here.
        (0x700, [state]) => NodeState::of(*state).map(|state| Message::Heartbeat { node, state }),
        _ => None,
    }
}

/// Returns the meaning of an emergency error code in the classes of CiA 301; `cia402` names the codes of drives.
pub fn emergency_name(code: u16) -> &'static str {
    match code {
        0x8110 => "CAN overrun: messages were lost",
        0x8120 => "CAN in error passive mode",
        0x8130 => "heartbeat of the controller was missed",
        0x8140 => "recovered from bus off",
        0x8150 => "transmit COB-ID collision",
        0x8210 => "PDO not processed: its length is wrong",
        0x8220 => "PDO length exceeded",
        0x8240 => "unexpected SYNC data length",
        0x8250 => "RPDO timeout",
        _ => cia402::error_name(code),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_says_what_its_identifier_and_its_length_say() {
        assert_eq!(read(&Frame::new(0x705, &[5])), Some(Message::Heartbeat { node: 5, state: NodeState::Operational }));
        assert_eq!(read(&Frame::new(0x705, &[5, 5])), None);
        assert_eq!(read(&Frame::new(0x705, &[17])), None);
        assert_eq!(read(&Frame::new(0x285, &[1])), Some(Message::Pdo { node: 5, number: 2, bytes: &[1] }));
        assert_eq!(read(&Frame::new(0x085, &[0x21, 0x71, 0, 0, 0, 0, 0, 0])), Some(Message::Emergency { node: 5, code: 0x7121 }));
        assert_eq!(read(&Frame::new(0x085, &[0x21, 0x71])), None);
        assert_eq!(read(&Frame::new(0x080, &[])), None);
    }
}
