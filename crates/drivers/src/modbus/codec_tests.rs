// SPDX-License-Identifier: Apache-2.0
//! Tests of the codec with arbitrary incoming bytes.
use super::frame::*;
use super::map::{Block, End, blocks, places};
use super::pdu::*;
use proptest::prelude::*;
use serde_json::json;

/// Pseudo-random numbers, which are the same in each run.
struct Draws(u64);

impl Draws {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }
}

fn every_form() -> Vec<Block> {
    let channels = json!({
        "a": { "holding": 0, "type": "double", "order": "CDAB" }, "b": { "holding": 4, "type": "int32", "raw": true }, "c": { "holding": 6, "bit": 15 },
        "d": { "coil": 0 }, "e": { "coil": 9 },
    });
    let (_, places) = places(channels.as_object().expect("a table"), End::Client).expect("they are right");
    blocks(&places, 20)
}

#[test]
fn the_checksum_is_that_of_the_standard() {
    assert_eq!(rtu(1, &[0x04, 0x02, 0xFF, 0xFF]).0[..7], [0x01, 0x04, 0x02, 0xFF, 0xFF, 0xB8, 0x80]);
    assert_eq!(crc16(b"123456789"), 0x4B37);
}

#[test]
fn a_device_answers_what_it_was_asked() {
    let read = Request::Read { space: Space::Input, address: 8, count: 1 };
    assert_eq!(read.encode().bytes(), [4, 0, 8, 0, 1]);
    assert_eq!(read.answer(&[4, 2, 0, 10]), Ok(&[0, 10][..]));
    assert_eq!(read.answer(&[0x84, 2]), Err(NoAnswer::Refused(Exception::ILLEGAL_ADDRESS)));
    assert_eq!(Exception::ILLEGAL_ADDRESS.to_string(), "illegal data address (exception 2)");
    for foreign in [&[3, 2, 0, 10][..], &[4, 4, 0, 10, 0, 0], &[4, 2, 0], &[0x83, 2], &[], &[4]] {
        assert_eq!(read.answer(foreign), Err(NoAnswer::Foreign), "{foreign:?}");
    }
    let write = Request::Write { space: Space::Holding, address: 1, count: 2, data: &[0, 10, 1, 2] };
    assert_eq!(write.encode().bytes(), [16, 0, 1, 0, 2, 4, 0, 10, 1, 2]);
    assert_eq!((write.answer(&[16, 0, 1, 0, 2]), write.answer(&[16, 0, 1, 0, 3])), (Ok(&[][..]), Err(NoAnswer::Foreign)));
    let coil = Request::Write { space: Space::Coil, address: 0xAC, count: 1, data: &[1] };
    assert_eq!(coil.encode().bytes(), [5, 0, 0xAC, 0xFF, 0]);
    let (each, more) = objects(&[1, 0xFF, 2, 2, 0, 3, b'a', b'b', b'c', 1, 1, b'd']);
    assert_eq!((each.collect::<Vec<_>>(), more), (vec![(0, &b"abc"[..]), (1, &b"d"[..])], Some(2)));
}

#[test]
fn no_corrupted_frame_of_a_serial_line_is_an_answer() {
    // Guarantees of the checksum: it detects all bursts of up to 16 bits, all errors of up to 3 bits, all of an odd number of bits; and
    // truncation.
    let mut draws = Draws(1);
    let mut accepted = 0_u32;
    for _ in 0..1_000_000 {
        let count = 1 + draws.below(40) as u16;
        let request = Request::Read { space: Space::Holding, address: 0, count };
        let mut pdu = Pdu::EMPTY;
        pdu.put(&[3, 2 * count as u8]);
        for _ in 0..count {
            pdu.put_u16(draws.below(0x1_0000) as u16);
        }
        let (mut bytes, len) = rtu(17, pdu.bytes());
        let cut = match draws.below(4) {
            0 => draws.below(len),
            kind => {
                corrupt(&mut bytes[..len], kind, &mut draws);
                len
            }
        };
        let frame = &bytes[..cut];
        let whole = matches!(answer_len(frame), Ok(Some(len)) if len == cut);
        let answer = unframed(frame).ok().filter(|(unit, _)| *unit == 17).map(|(_, pdu)| request.answer(pdu));
        accepted += u32::from(whole && matches!(answer, Some(Ok(_) | Err(NoAnswer::Refused(_)))));
    }
    assert_eq!(accepted, 0);
}

/// Flips at least one bit.
fn corrupt(frame: &mut [u8], kind: usize, draws: &mut Draws) {
    let bits = 8 * frame.len();
    let mut flip = |bit: usize| frame[bit / 8] ^= 1 << (bit % 8);
    if kind == 1 {
        // A burst: its first and its last bit are flipped, those between may be.
        let (from, long) = (draws.below(bits - 16), 1 + draws.below(16));
        flip(from);
        (from + 1..from + long).filter(|_| draws.below(2) == 1).for_each(&mut flip);
        return;
    }
    // Separate bits: 1 to 3 of them, or any odd number.
    let count = if kind == 2 { 1 + draws.below(3) } else { 1 + 2 * draws.below(20) };
    let (from, step) = (draws.below(bits), 1 + draws.below(bits / 64 + 1));
    (0..count).for_each(|i| flip((from + i * step) % bits));
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400), count in 1_u16..200) {
        let _ = (unframed(&bytes).is_ok(), answer_len(&bytes).is_ok(), Request::decode(&bytes).is_ok());
        if let Ok(Some(frame)) = framed(&bytes) {
            prop_assert!(frame.len <= bytes.len() && frame.pdu.len() <= PDU_MAX && !frame.pdu.is_empty());
        }
        for request in [Request::Read { space: Space::Coil, address: 0, count }, Request::Read { space: Space::Input, address: 9, count }, Request::Identify { from: 0 }] {
            let _ = request.answer(&bytes).is_ok();
        }
        prop_assert!(objects(&bytes).0.count() <= bytes.len());
        let mut readings = [0; 64];
        every_form().iter().for_each(|block| block.store(&bytes, &mut readings));
    }

    #[test]
    fn a_request_arrives_as_it_was_sent(unit in any::<u8>(), transaction in any::<u16>(), address in any::<u16>(), data in proptest::collection::vec(any::<u8>(), 1..=123)) {
        let registers: Vec<u8> = data.iter().flat_map(|byte| [*byte, !byte]).collect();
        let request = Request::Write { space: Space::Holding, address, count: data.len() as u16, data: &registers };
        let pdu = request.encode();
        prop_assert_eq!(Request::decode(pdu.bytes()), Ok(request));
        let (frame, len) = mbap(transaction, unit, pdu.bytes());
        let whole = framed(&frame[..len]);
        prop_assert_eq!(whole, Ok(Some(TcpFrame { transaction, unit, pdu: pdu.bytes(), len })));
        // A partial frame is incomplete, and not an error.
        (0..len).for_each(|cut| assert_eq!(framed(&frame[..cut]), Ok(None)));
        let (frame, len) = rtu(unit, pdu.bytes());
        prop_assert_eq!(unframed(&frame[..len]), Ok((unit, pdu.bytes())));
    }

    #[test]
    fn any_answer_is_as_long_as_it_says(begins in proptest::collection::vec(any::<u8>(), 3..300)) {
        // More bytes never change the length derived from the first ones.
        if let Ok(Some(len)) = answer_len(&begins) {
            let mut more = begins.clone();
            more.push(0);
            prop_assert_eq!(answer_len(&more), Ok(Some(len)));
        }
    }
}
