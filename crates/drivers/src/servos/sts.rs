// SPDX-License-Identifier: Apache-2.0
//! Frames of Feetech's STS servos: `ff ff id length word … sum`, where `length` counts the bytes after it and `sum` is the complement of
//! the sum of all bytes from the ID on. In an answer, the word is a set of error bits.
use super::frame::{Answer, Ask, BROADCAST, Frame, FrameScan};

const HEAD: u8 = 0xff;
/// Number of bytes before the word: two header bytes, the ID, the length.
const BEFORE: usize = 4;

/// Computes the checksum of a frame from the bytes between header and checksum.
fn sum(bytes: &[u8]) -> u8 {
    !bytes.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte))
}

pub(super) fn write(frame: &mut Frame, id: u8, ask: Ask<'_>) -> bool {
    let (id, word) = match ask {
        Ask::Ping => (id, 1),
        Ask::Read { .. } => (id, 2),
        Ask::Write { .. } => (id, 3),
        Ask::SyncRead { .. } => (BROADCAST, 0x82),
        Ask::SyncWrite { .. } => (BROADCAST, 0x83),
        Ask::Reboot => return false,
    };
    frame.push(&[HEAD, HEAD, id, 0, word]);
    match ask {
        Ask::Ping | Ask::Reboot => {}
        Ask::Read { address, len } => frame.push(&[address as u8, len as u8]),
        Ask::Write { address, bytes } => {
            frame.push(&[address as u8]);
            frame.push(bytes);
        }
        Ask::SyncRead { address, len, ids } => {
            frame.push(&[address as u8, len as u8]);
            frame.push(ids);
        }
        Ask::SyncWrite { address, len, rows } => {
            frame.push(&[address as u8, len as u8]);
            frame.push(rows);
        }
    }
    let Ok(length) = u8::try_from(frame.bytes().len() - BEFORE + 1) else { return false };
    frame.set(3, length);
    frame.push(&[sum(&frame.bytes()[2..])]);
    true
}

pub(super) fn take(bytes: &[u8]) -> FrameScan<'_> {
    let head = bytes.iter().position(|byte| *byte == HEAD);
    match head {
        None => return FrameScan::Skip(bytes.len()),
        Some(0) => {}
        Some(at) => return FrameScan::Skip(at),
    }
    match *bytes {
        [_] | [_, HEAD] => FrameScan::Part,
        // A third header byte: the frame starts one byte later, because no servo has that id.
        [_, HEAD, HEAD, ..] => FrameScan::Skip(1),
        [_, HEAD, id, ..] if id > super::frame::ID_MAX => FrameScan::Bad(2),
        [_, HEAD, _] => FrameScan::Part,
        [_, HEAD, _, length, ..] if length < 2 => FrameScan::Bad(2),
        [_, HEAD, id, length, ..] => whole(bytes, id, length),
        _ => FrameScan::Skip(1),
    }
}

fn whole(bytes: &[u8], id: u8, length: u8) -> FrameScan<'_> {
    let end = BEFORE + usize::from(length);
    let Some(frame) = bytes.get(..end) else { return FrameScan::Part };
    if sum(&frame[2..end - 1]) != frame[end - 1] {
        return FrameScan::Bad(2);
    }
    FrameScan::Frame(end, Some(Answer { id, error: frame[BEFORE], bytes: &frame[BEFORE + 1..end - 1] }))
}
