// SPDX-License-Identifier: Apache-2.0
//! Malformed frames: a million of them, none of which is accepted. Bit errors in the data of a frame on the wire are detected by the CRC
//! of CAN in the adapter.
mod common;
use canopen::frame::{self, Came, FRAME_LEN, Frame};
use canopen::message::{self, Message};
use canopen::sdo::{SdoOutcome, Transfer};
use cia402::Entry;
use proptest::prelude::*;

const FRAMES: usize = 1_000_000;

/// Pseudo-random numbers from a fixed seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }
}

/// Returns true if a frame contains the process data of node 5 as configured: 8 bytes.
fn is_taken(bytes: &[u8]) -> bool {
    let Came::Frame(frame) = frame::read(bytes) else { return false };
    matches!(message::read(&frame), Some(Message::Pdo { node: 5, number: 1, bytes }) if bytes.len() == 8)
}

#[test]
fn of_a_million_changed_frames_none_is_taken() {
    let good = Frame::new(0x185, &[0x37, 0x02, 1, 2, 3, 4, 5, 6]).encoded();
    assert!(is_taken(&good));
    let (mut random, mut changed) = (Random(17), 0);
    while changed < FRAMES {
        let mut bytes = good;
        for _ in 0..=random.next() % 3 {
            // A bit of the identifier, the flags or the length.
            let bit = random.next() as usize % 40;
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        let len = if random.next() % 8 == 0 { random.next() as usize % FRAME_LEN } else { FRAME_LEN };
        if bytes == good && len == FRAME_LEN {
            continue;
        }
        assert!(!is_taken(&bytes[..len]), "{bytes:?}, {len} of them");
        changed += 1;
    }
}

#[test]
fn of_a_million_changed_answers_none_is_a_value() {
    let of = Entry { index: 0x6041, sub: 0 };
    let good = [0x4B, 0x41, 0x60, 0x00, 0x37, 0x02, 0, 0];
    assert_eq!(Transfer::upload(of).0.answer(&good), SdoOutcome::Done(vec![0x37, 0x02]));
    let mut random = Random(23);
    for _ in 0..FRAMES {
        let mut bytes = good;
        // A bit of the object's index or subindex.
        let bit = 8 + random.next() as usize % 24;
        bytes[bit / 8] ^= 1 << (bit % 8);
        let command = random.next() as u8;
        bytes[0] = if command >> 5 == 2 { bytes[0] } else { command };
        let answered = Transfer::upload(of).0.answer(&bytes);
        assert_eq!(answered, SdoOutcome::Strange, "{bytes:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_bytes_are_read(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
        if let Came::Frame(frame) = frame::read(&bytes) {
            let _ = message::read(&frame);
            prop_assert!(frame.bytes().len() <= 8);
        }
    }

    #[test]
    fn any_answers_end_a_transfer_or_leave_it(answers in proptest::collection::vec(any::<[u8; 8]>(), 0..40), value in proptest::collection::vec(any::<u8>(), 0..40)) {
        let of = Entry { index: 0x1008, sub: 0 };
        for mut transfer in [Transfer::upload(of).0, Transfer::download(of, &value).0] {
            for answer in &answers {
                let _ = transfer.answer(answer);
            }
        }
    }

    #[test]
    fn an_emulated_bus_takes_any_frames(frames in proptest::collection::vec((0u16..0x800, proptest::collection::vec(any::<u8>(), 0..9)), 0..60)) {
        let mut bus = common::two_drives();
        for (id, bytes) in &frames {
            bus.take(&Frame::new(*id, bytes));
            bus.go_on(1_000_000);
        }
        while bus.said().is_some() {}
    }
}
