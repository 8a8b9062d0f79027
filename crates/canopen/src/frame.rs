// SPDX-License-Identifier: Apache-2.0
//! CAN frames in the SocketCAN format: 16 bytes each.

/// Size of a frame on a socket, bytes.
pub const FRAME_LEN: usize = 16;
/// Flags of an identifier on a socket: 29-bit identifier, remote request, bus report.
pub const EXTENDED: u32 = 0x8000_0000;
pub const REMOTE: u32 = 0x4000_0000;
pub const ERROR: u32 = 0x2000_0000;
const STANDARD_MAX: u32 = 0x7FF;
/// Classes of bus reports, and values of the second byte of a report about the controller.
pub const CONTROLLER: u32 = 0x0004;
pub const BUS_OFF: u32 = 0x0040;
pub const RESTARTED: u32 = 0x0100;
pub const RECEIVE_OVERFLOW: u8 = 0x01;
pub const PASSIVE: u8 = 0x30;

/// A data frame with an 11-bit identifier, the only kind that CANopen uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    pub id: u16,
    len: u8,
    data: [u8; 8],
}

/// Frame or bus report from a socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Came {
    Frame(Frame),
    /// A bus report: its classes, and the state of the controller.
    Report {
        classes: u32,
        controller: u8,
    },
    /// Bytes that are not a CANopen frame: a 29-bit identifier, a remote request, more than 8 bytes, or an incomplete frame.
    Strange,
}

impl Frame {
    /// Creates a frame of up to 8 bytes; longer data are truncated.
    pub fn new(id: u16, bytes: &[u8]) -> Frame {
        let len = bytes.len().min(8);
        let mut data = [0; 8];
        data[..len].copy_from_slice(&bytes[..len]);
        Frame { id: id & STANDARD_MAX as u16, len: len as u8, data }
    }

    pub fn bytes(&self) -> &[u8] {
        &self.data[..usize::from(self.len)]
    }

    /// Returns the frame in the socket format.
    pub fn encoded(&self) -> [u8; FRAME_LEN] {
        let mut all = [0; FRAME_LEN];
        all[..4].copy_from_slice(&u32::from(self.id).to_ne_bytes());
        all[4] = self.len;
        all[8..].copy_from_slice(&self.data);
        all
    }
}

/// Parses a frame from a socket. Real-time safe.
pub fn read(bytes: &[u8]) -> Came {
    let Ok(all) = <&[u8; FRAME_LEN]>::try_from(bytes) else { return Came::Strange };
    let id = u32::from_ne_bytes([all[0], all[1], all[2], all[3]]);
    let len = all[4];
    if id & ERROR != 0 {
        return Came::Report { classes: id & !(EXTENDED | REMOTE | ERROR), controller: all[9] };
    }
    if id > STANDARD_MAX || len > 8 {
        return Came::Strange;
    }
    Came::Frame(Frame::new(id as u16, &all[8..8 + usize::from(len)]))
}

/// Returns a bus report in the socket format.
pub fn report(classes: u32, controller: u8) -> [u8; FRAME_LEN] {
    let mut all = [0; FRAME_LEN];
    all[..4].copy_from_slice(&(ERROR | classes).to_ne_bytes());
    (all[4], all[9]) = (8, controller);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_read_as_it_was_written() {
        let frame = Frame::new(0x181, &[1, 2, 3]);
        assert_eq!(read(&frame.encoded()), Came::Frame(frame));
        assert_eq!(read(&report(BUS_OFF, 0)), Came::Report { classes: BUS_OFF, controller: 0 });
    }

    #[test]
    fn what_is_no_frame_of_canopen_is_strange() {
        let good = Frame::new(0x181, &[1, 2, 3]).encoded();
        for flag in [EXTENDED, REMOTE, 0x800] {
            let mut bytes = good;
            bytes[..4].copy_from_slice(&(0x181 | flag).to_ne_bytes());
            assert_eq!(read(&bytes), Came::Strange);
        }
        let mut long = good;
        long[4] = 9;
        assert_eq!(read(&long), Came::Strange);
        assert_eq!((read(&good[..15]), read(&[])), (Came::Strange, Came::Strange));
    }
}
