// SPDX-License-Identifier: Apache-2.0
//! Frames of the Dynamixel protocol 2.0: `ff ff fd 00 id length(2) word … crc(2)`. If the header sequence occurs after the length, a byte
//! `fd` is stuffed after it. The word of an answer is 0x55, followed by its error.
use super::frame::{Answer, Ask, BROADCAST, FRAME_MAX, Frame, FrameScan, ID_MAX};

const HEAD: [u8; 4] = [0xff, 0xff, 0xfd, 0x00];
/// Byte sequence after which a byte is stuffed.
const STUFFED: [u8; 3] = [0xff, 0xff, 0xfd];
/// Number of bytes before the word: the header, the ID, the length.
const BEFORE: usize = 7;
const ANSWER: u8 = 0x55;
/// Polynomial x^16 + x^15 + x^2 + 1.
const POLYNOMIAL: u16 = 0x8005;
const CRC: [u16; 256] = table();

const fn table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = (byte as u16) << 8;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x8000 == 0 { crc << 1 } else { (crc << 1) ^ POLYNOMIAL };
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

/// Computes the CRC-16 over a frame without its last two bytes.
pub(super) fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc, byte| (crc << 8) ^ CRC[usize::from((crc >> 8) ^ u16::from(*byte))])
}

pub(super) fn write(frame: &mut Frame, id: u8, ask: Ask<'_>) -> bool {
    let (id, word) = match ask {
        Ask::Ping => (id, 1),
        Ask::Read { .. } => (id, 2),
        Ask::Write { .. } => (id, 3),
        Ask::Reboot => (id, 8),
        Ask::SyncRead { .. } => (BROADCAST, 0x82),
        Ask::SyncWrite { .. } => (BROADCAST, 0x83),
    };
    frame.push(&HEAD);
    frame.push(&[id, 0, 0]);
    let mut body = Stuffing { frame, last: [0; 2] };
    body.push(&[word]);
    match ask {
        Ask::Ping | Ask::Reboot => {}
        Ask::Read { address, len } => {
            body.push(&address.to_le_bytes());
            body.push(&len.to_le_bytes());
        }
        Ask::Write { address, bytes } => {
            body.push(&address.to_le_bytes());
            body.push(bytes);
        }
        Ask::SyncRead { address, len, ids: rows } | Ask::SyncWrite { address, len, rows } => {
            body.push(&address.to_le_bytes());
            body.push(&len.to_le_bytes());
            body.push(rows);
        }
    }
    // The two bytes of the CRC are still to come.
    let [low, high] = u16::try_from(frame.bytes().len() - BEFORE + 2).unwrap_or(u16::MAX).to_le_bytes();
    frame.set(5, low);
    frame.set(6, high);
    frame.push(&crc(frame.bytes()).to_le_bytes());
    true
}

/// Writer for the bytes after the length of a frame, with byte stuffing.
struct Stuffing<'a> {
    frame: &'a mut Frame,
    last: [u8; 2],
}

impl Stuffing<'_> {
    fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.frame.push(&[*byte]);
            let [first, second] = self.last;
            self.last = [second, *byte];
            if [first, second, *byte] == STUFFED {
                self.frame.push(&STUFFED[2..]);
                self.last = [0; 2];
            }
        }
    }
}

pub(super) fn take<'a>(bytes: &'a [u8], scratch: &'a mut [u8; FRAME_MAX]) -> FrameScan<'a> {
    let head = (0..bytes.len()).find(|at| bytes[*at..].iter().zip(HEAD).all(|(byte, head)| *byte == head));
    match head {
        None => return FrameScan::Skip(bytes.len()),
        Some(0) => {}
        Some(at) => return FrameScan::Skip(at),
    }
    let [.., id, low, high] = *bytes.get(..BEFORE).unwrap_or_default() else { return FrameScan::Part };
    let length = usize::from(u16::from_le_bytes([low, high]));
    let end = BEFORE + length;
    if length < 3 || end > FRAME_MAX {
        return FrameScan::Bad(HEAD.len());
    }
    let Some(frame) = bytes.get(..end) else { return FrameScan::Part };
    let (checked, crc_of) = frame.split_at(end - 2);
    if crc(checked).to_le_bytes() != crc_of {
        return FrameScan::Bad(HEAD.len());
    }
    let len = unstuff(&checked[BEFORE..], scratch);
    match &scratch[..len] {
        [ANSWER, error, bytes @ ..] if id <= ID_MAX => FrameScan::Frame(end, Some(Answer { id, error: *error, bytes })),
        _ => FrameScan::Frame(end, None),
    }
}

/// Copies bytes with the stuffing removed, and returns their number.
fn unstuff(from: &[u8], to: &mut [u8; FRAME_MAX]) -> usize {
    let (mut len, mut last, mut is_stuffed) = (0, [0; 2], false);
    for byte in from {
        if std::mem::take(&mut is_stuffed) && *byte == STUFFED[2] {
            last = [0; 2];
            continue;
        }
        to[len] = *byte;
        len += 1;
        is_stuffed = [last[0], last[1], *byte] == STUFFED;
        last = [last[1], *byte];
    }
    len
}
