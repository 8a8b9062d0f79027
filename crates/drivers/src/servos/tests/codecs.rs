// SPDX-License-Identifier: Apache-2.0
use crate::servos::frame::{Answer, Ask, FRAME_MAX, Frame, FrameScan};
use crate::servos::protocol::Protocol;
use crate::servos::{dynamixel2, registers};
use proptest::prelude::*;

const BOTH: [Protocol; 2] = [Protocol::Sts, Protocol::Dynamixel];

fn asked(protocol: Protocol, id: u8, ask: Ask<'_>) -> Vec<u8> {
    let mut frame = Frame::new();
    assert!(protocol.write(&mut frame, id, ask));
    frame.bytes().to_vec()
}

/// Returns the answer of a servo, encoded according to the manufacturer's manual and not by the code under test.
pub(super) fn answer(protocol: Protocol, id: u8, error: u8, bytes: &[u8]) -> Vec<u8> {
    match protocol {
        Protocol::Sts => {
            let body = [&[id, bytes.len() as u8 + 2, error], bytes].concat();
            let sum = !body.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
            [&[0xff, 0xff][..], &body, &[sum]].concat()
        }
        Protocol::Dynamixel => {
            let mut body = vec![0x55, error];
            for byte in bytes {
                body.push(*byte);
                if body.ends_with(&[0xff, 0xff, 0xfd]) {
                    body.push(0xfd);
                }
            }
            let mut frame = [&[0xff, 0xff, 0xfd, 0, id][..], &(body.len() as u16 + 2).to_le_bytes(), &body].concat();
            let crc = dynamixel2::crc(&frame);
            frame.extend_from_slice(&crc.to_le_bytes());
            frame
        }
    }
}

/// Returns every answer in a stream, as parsed by the bus.
fn answers(protocol: Protocol, stream: &[u8]) -> Vec<(u8, u8, Vec<u8>)> {
    let (mut from, mut scratch, mut found) = (0, [0; FRAME_MAX], Vec::new());
    while from < stream.len() {
        from += match protocol.take(&stream[from..], &mut scratch) {
            FrameScan::Part => break,
            FrameScan::Skip(count) | FrameScan::Bad(count) => {
                assert!(count > 0, "it gets on");
                count
            }
            FrameScan::Frame(count, answer) => {
                found.extend(answer.map(|Answer { id, error, bytes }| (id, error, bytes.to_vec())));
                count
            }
        };
        assert!(from <= stream.len(), "it takes no more than there is");
    }
    found
}

/// Checks that requests match those in the manufacturers' manuals: a read of the position of servo 1, a ping, a write, goals of two
/// servos.
#[test]
fn requests_are_those_of_the_manuals() {
    assert_eq!(asked(Protocol::Sts, 1, Ask::Ping), [0xff, 0xff, 1, 2, 1, 0xfb]);
    assert_eq!(asked(Protocol::Sts, 1, Ask::Read { address: 0x38, len: 2 }), [0xff, 0xff, 1, 4, 2, 0x38, 2, 0xbe]);
    assert_eq!(asked(Protocol::Dynamixel, 1, Ask::Ping), [0xff, 0xff, 0xfd, 0, 1, 3, 0, 1, 0x19, 0x4e]);
    assert_eq!(asked(Protocol::Dynamixel, 1, Ask::Read { address: 132, len: 4 }), [0xff, 0xff, 0xfd, 0, 1, 7, 0, 2, 0x84, 0, 4, 0, 0x1d, 0x15]);
    assert_eq!(
        asked(Protocol::Dynamixel, 1, Ask::Write { address: 116, bytes: &[0, 2, 0, 0] }),
        [0xff, 0xff, 0xfd, 0, 1, 9, 0, 3, 0x74, 0, 0, 2, 0, 0, 0xca, 0x89]
    );
    assert_eq!(asked(Protocol::Dynamixel, 1, Ask::Reboot), [0xff, 0xff, 0xfd, 0, 1, 3, 0, 8, 0x2f, 0x4e]);
    assert!(!Protocol::Sts.write(&mut Frame::new(), 1, Ask::Reboot));
    assert!(!Protocol::Sts.write(&mut Frame::new(), 1, Ask::Write { address: 0, bytes: &[0; 300] }));
    assert!(!Protocol::Dynamixel.write(&mut Frame::new(), 1, Ask::Write { address: 0, bytes: &[0; 600] }));
}

#[test]
fn a_header_among_what_is_sent_is_stuffed() {
    let frame = asked(Protocol::Dynamixel, 1, Ask::Write { address: 0, bytes: &[0xff, 0xff, 0xfd, 0xff, 0xff, 0xfd] });
    assert_eq!(frame[10..18], [0xff, 0xff, 0xfd, 0xfd, 0xff, 0xff, 0xfd, 0xfd]);
    assert_eq!(
        answers(Protocol::Dynamixel, &answer(Protocol::Dynamixel, 9, 0, &[0xff, 0xff, 0xfd, 0xff, 0xff, 0xfd, 0xfd])),
        [(9, 0, vec![0xff, 0xff, 0xfd, 0xff, 0xff, 0xfd, 0xfd])]
    );
}

/// Checks that, out of 10^6 answers with a changed byte or a truncated end, none is accepted as an answer of the same servo and length.
#[test]
fn no_corrupted_answer_is_taken() {
    let mut tried = 0;
    for protocol in BOTH {
        let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
        let mut chosen = || {
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            seed
        };
        let mut of_this = 0;
        while of_this < 500_000 {
            let bytes: Vec<u8> = (0..15).map(|_| chosen() as u8).collect();
            let whole = answer(protocol, chosen() as u8 % 6 + 1, 0, &bytes);
            let (id, len) = (whole[if protocol == Protocol::Sts { 2 } else { 4 }], bytes.len());
            let accepted = |stream: &[u8]| answers(protocol, stream).iter().any(|(of, _, bytes)| *of == id && bytes.len() == len);
            assert!(accepted(&whole));
            let mut changed = whole.clone();
            for at in 0..whole.len() {
                for _ in 0..20 {
                    changed[at] = whole[at] ^ (chosen() as u8).max(1);
                    assert!(!accepted(&changed), "{protocol:?}: {whole:?} with byte {at} as {}", changed[at]);
                    of_this += 1;
                }
                changed[at] = whole[at];
                assert!(!accepted(&whole[..at]));
                of_this += 1;
            }
        }
        tried += of_this;
    }
    assert!(tried >= 1_000_000);
}

#[test]
fn numbers_have_their_signs() {
    for (counts, bytes) in [(2048.0, [0, 8]), (-1.0, [1, 0x80]), (4095.4, [0xff, 0x0f])] {
        assert_eq!(Protocol::Sts.goal(counts)[..2], bytes);
    }
    assert_eq!(Protocol::Dynamixel.goal(-2.0), [0xfe, 0xff, 0xff, 0xff]);
    assert_eq!((Protocol::Sts.offset(0x0800 | 5), Protocol::Sts.offset(5), Protocol::Dynamixel.offset(u32::MAX)), (-5, 5, -1));
    let present = Protocol::Sts.present(&[1, 0x80, 0, 0, 0xf4, 0x05, 120, 40, 0, 0x20, 1, 0, 0, 10, 0x80]).expect("it is whole");
    assert_eq!((present.counts, present.load, present.current, present.error), (-1.0, -0.5, -10.0, 0x20));
    assert_eq!((present.voltage, present.temperature), (12.0, 313.15));
    let map = registers::Map::of(Protocol::Sts);
    assert_eq!(map.named(0b10_0100), "overheat and overload");
}

proptest! {
    #[test]
    fn any_bytes_may_come(stream in prop::collection::vec(prop_oneof![Just(0xff_u8), Just(0xfd), 0_u8..8, any::<u8>()], 0..1200)) {
        for protocol in BOTH {
            answers(protocol, &stream);
        }
    }

    #[test]
    fn an_answer_is_found_behind_noise(
        noise in prop::collection::vec(0_u8..0xff, 0..20), id in 0_u8..0xfd, error in any::<u8>(),
        bytes in prop::collection::vec(prop_oneof![Just(0xff_u8), Just(0xfd), any::<u8>()], 0..60)
    ) {
        for protocol in BOTH {
            let stream = [noise.clone(), answer(protocol, id, error, &bytes)].concat();
            prop_assert_eq!(answers(protocol, &stream).pop(), Some((id, error, bytes.clone())));
        }
    }

    #[test]
    fn any_bytes_are_no_reading_or_one(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
        for protocol in BOTH {
            let whole = usize::from(registers::Map::of(protocol).present.len);
            prop_assert_eq!(protocol.present(&bytes).is_some(), bytes.len() >= whole);
        }
    }
}
