// SPDX-License-Identifier: Apache-2.0
//! Arbitrary bytes for this Modbus implementation to parse, for fuzzers: parsing never panics, and accepted bytes are identical to their
//! encoding.
use super::frame::{FRAME_MAX, answer_len, framed, mbap, rtu, unframed};
use super::map::{Block, End, MappedChannel, blocks, places};
use super::pdu::{NoAnswer, PDU_MAX, Request, Space, objects, refusal};
use super::server::Tables;
use serde_json::json;
use std::sync::LazyLock;

/// Total length in bytes of the channels of [`PLACES`].
const READINGS: usize = 128;

/// Channels, one of each format.
static PLACES: LazyLock<Vec<MappedChannel>> = LazyLock::new(|| {
    let channels = json!({
        "a": { "holding": 0, "type": "double", "order": "CDAB" }, "b": { "holding": 4, "type": "int32", "raw": true }, "c": { "holding": 6, "bit": 15 },
        "d": { "coil": 0 }, "e": { "coil": 9 }, "f": { "holding": 8, "type": "int16", "write": true }, "g": { "coil": 12, "write": true },
    });
    places(channels.as_object().expect("a table"), End::Server).expect("they are right").1
});

/// Blocks in which a client reads the channels of [`PLACES`].
static BLOCKS: LazyLock<Vec<Block>> = LazyLock::new(|| blocks(&PLACES, 20));

/// Parses bytes. The first one selects the meaning of the others: requests to a server, an answer to a client, or a frame on a serial
/// line.
pub fn modbus(bytes: &[u8]) {
    match bytes.split_first() {
        Some((0, rest)) => requests(rest),
        Some((1, rest)) => answers(rest),
        Some((_, rest)) => line(rest),
        None => {}
    }
}

/// Checks that each request is carried out or refused, and that the frame of the answer parses to the answer that was encoded.
fn requests(mut bytes: &[u8]) {
    let mut tables = Tables::new(&PLACES);
    while let Ok(Some(frame)) = framed(bytes) {
        assert!(frame.len <= bytes.len() && (1..=PDU_MAX).contains(&frame.pdu.len()), "{frame:?}");
        bytes = &bytes[frame.len..];
        let carried = tables.carry_out(frame.pdu);
        let answer = carried.clone().unwrap_or_else(|why| refusal(frame.pdu[0], why));
        assert_eq!(answer.bytes()[0] & 0x7F, frame.pdu[0] & 0x7F, "{:?} is answered by its own function", frame.pdu);
        if let (Ok(_), Ok(request)) = (carried, Request::decode(frame.pdu)) {
            let is_ours = request.encode().bytes()[0] == frame.pdu[0];
            assert!(!is_ours || request.answer(answer.bytes()).is_ok(), "{request:?} is answered by {:?}", answer.bytes());
        }
        let (again, len) = mbap(frame.transaction, frame.unit, answer.bytes());
        let again = framed(&again[..len]).ok().flatten().expect("what was written is a frame");
        assert_eq!((again.transaction, again.unit, again.pdu), (frame.transaction, frame.unit, answer.bytes()));
    }
}

/// Parses answers; the first two bytes select the request.
fn answers(bytes: &[u8]) {
    let [table, count, pdu @ ..] = bytes else { return };
    let space = [Space::Coil, Space::Discrete, Space::Input, Space::Holding][usize::from(table % 4)];
    let count = 1 + u16::from(*count) % space.read_max();
    let read = Request::Read { space, address: 0, count };
    if let Ok(data) = read.answer(pdu) {
        assert_eq!(data.len(), space.bytes(count));
    }
    let written = [0x55; 4];
    let write = Request::Write { space: Space::Holding, address: count, count: 2, data: &written };
    let _: Result<&[u8], NoAnswer> = write.answer(pdu);
    if let Ok(data) = (Request::Identify { from: 0 }).answer(pdu) {
        assert!(objects(data).0.map(|(_, text)| 2 + text.len()).sum::<usize>() <= data.len());
    }
    let mut readings = [0; READINGS];
    BLOCKS.iter().for_each(|block| block.store(pdu, &mut readings));
}

/// Checks that a frame has the length derived from its first bytes, and is the only encoding of its unit and PDU.
fn line(bytes: &[u8]) {
    if let Ok(Some(len)) = answer_len(bytes) {
        assert!(len <= FRAME_MAX);
        assert_eq!(answer_len(&[bytes, &[0]].concat()), Ok(Some(len)), "more bytes never change what the first ones said");
    }
    if let Ok((unit, pdu)) = unframed(bytes) {
        let (frame, len) = rtu(unit, pdu);
        assert_eq!(&frame[..len], bytes);
    }
    if let Some((unit, pdu)) = bytes.split_first().filter(|(_, pdu)| (1..=PDU_MAX).contains(&pdu.len())) {
        let (frame, len) = rtu(*unit, pdu);
        assert_eq!(unframed(&frame[..len]), Ok((*unit, pdu)));
    }
}
