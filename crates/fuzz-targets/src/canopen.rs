// SPDX-License-Identifier: Apache-2.0
//! CANopen fuzz targets: frames of a socket, responses of SDO servers, electronic data sheets and an emulated bus.
use canopen::eds::Eds;
use canopen::emulator::{Bus, NodeOptions, Terminals};
use canopen::frame::{self, Came, FRAME_LEN, Frame};
use canopen::message;
use canopen::sdo::{SdoOutcome, Transfer};
use cia402::Entry;

/// Exclusive upper bound of the length of a written value.
const VALUE_MAX: usize = 64;

/// Fuzzes the part selected by the first byte with the remaining bytes.
pub(crate) fn canopen(bytes: &[u8]) {
    match bytes.split_first() {
        Some((0, rest)) => socket(rest),
        Some((1, rest)) => answers(rest),
        Some((2, rest)) => data_sheet(rest),
        Some((_, rest)) => bus(rest),
        None => {}
    }
}

/// Checks that a decoded frame encodes to the same bytes.
fn socket(bytes: &[u8]) {
    for piece in bytes.chunks(FRAME_LEN) {
        let Came::Frame(read) = frame::read(piece) else { continue };
        assert_eq!(frame::read(&read.encoded()), Came::Frame(read));
        let _ = message::read(&read);
    }
}

/// Fuzzes SDO transfers: a length and a value to write, then responses of 8 bytes each to the write and to a read. Checks that a transfer
/// that has ended stays ended.
fn answers(bytes: &[u8]) {
    let Some((len, rest)) = bytes.split_first() else { return };
    let (value, answers) = rest.split_at(rest.len().min(usize::from(*len) % VALUE_MAX));
    let of = Entry { index: 0x1008, sub: 0 };
    for (mut transfer, _) in [Transfer::upload(of), Transfer::download(of, value)] {
        let mut is_over = false;
        for answer in answers.as_chunks::<8>().0 {
            let answered = transfer.answer(answer);
            assert!(!is_over || matches!(answered, SdoOutcome::Strange | SdoOutcome::Aborted(_)), "{answered:?} behind the end");
            is_over |= matches!(answered, SdoOutcome::Done(_) | SdoOutcome::Aborted(_) | SdoOutcome::Broken(_));
        }
    }
}

/// Checks that each object of an electronic data sheet is found under its index.
fn data_sheet(bytes: &[u8]) {
    let Ok(eds) = Eds::read(bytes) else { return };
    for (of, object) in eds.objects() {
        assert_eq!(eds.object(of).map(|found| &found.name), Some(&object.name));
        let _ = (eds.named(&object.name), eds.default_of(of, 5));
    }
    let _ = (eds.mapping(0x1600, 5), eds.mapping(0x1A00, 127));
}

/// Sends frames, each given as an identifier, a length and data, one millisecond apart, on a bus with a drive and a module.
fn bus(bytes: &[u8]) {
    let drive = NodeOptions { name: "x".into(), node: 5, ..NodeOptions::default() };
    let module =
        NodeOptions { name: "io".into(), node: 7, module: Some(Terminals { inputs: 8, outputs: 8, ..Terminals::default() }), ..NodeOptions::default() };
    let mut bus = Bus::new(&[drive, module]);
    for piece in bytes.chunks(11) {
        let [low, high, len, data @ ..] = piece else { break };
        bus.take(&Frame::new(u16::from_le_bytes([*low, *high]), &data[..data.len().min(usize::from(*len) % 9)]));
        bus.go_on(1_000_000);
        while let Some(said) = bus.said() {
            assert_ne!(frame::read(&said), Came::Strange, "a node says what CANopen has");
        }
    }
    let _ = bus.show();
}
