// SPDX-License-Identifier: Apache-2.0
//! Arbitrary bytes on the line of servos, for fuzzers: parsing never panics, each step advances, and data that is written parses as one
//! complete frame.
use super::frame::{Ask, FRAME_MAX, Frame, FrameScan, ID_MAX};
use super::protocol::Protocol;

/// Parses bytes. The first one selects the protocol, and determines whether the remaining bytes come from the line or are to be written.
pub fn servos(bytes: &[u8]) {
    let Some((how, rest)) = bytes.split_first() else { return };
    let protocol = if how & 1 == 0 { Protocol::Sts } else { Protocol::Dynamixel };
    if how & 2 == 0 { came(protocol, rest) } else { asked(protocol, rest) }
}

fn came(protocol: Protocol, mut stream: &[u8]) {
    let mut scratch = [0; FRAME_MAX];
    while !stream.is_empty() {
        let count = match protocol.take(stream, &mut scratch) {
            FrameScan::Part => return,
            FrameScan::Skip(count) | FrameScan::Bad(count) => count,
            FrameScan::Frame(count, answer) => {
                if let Some(answer) = answer {
                    assert!(answer.id <= ID_MAX && protocol.answer_len(answer.bytes.len()) <= count, "{answer:?} of {count} bytes");
                    let present = protocol.present(answer.bytes);
                    assert!(present.is_none_or(|is| is.counts.is_finite() && is.velocity.is_finite()), "{present:?}");
                }
                count
            }
        };
        assert!((1..=stream.len()).contains(&count), "it goes on, and takes no more than there is");
        stream = &stream[count..];
    }
}

/// Parses an id, an address, and the data to write there.
fn asked(protocol: Protocol, bytes: &[u8]) {
    let [id, low, high, body @ ..] = bytes else { return };
    let (mut frame, mut scratch) = (Frame::new(), [0; FRAME_MAX]);
    if !protocol.write(&mut frame, *id, Ask::Write { address: u16::from_le_bytes([*low, *high]), bytes: body }) {
        return;
    }
    let taken = protocol.take(frame.bytes(), &mut scratch);
    let is_whole = matches!(taken, FrameScan::Frame(len, _) if len == frame.bytes().len());
    assert!(is_whole || protocol == Protocol::Sts && *id > ID_MAX, "{:?} is {taken:?}", frame.bytes());
}
