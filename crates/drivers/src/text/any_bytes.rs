// SPDX-License-Identifier: Apache-2.0
//! Arbitrary bytes from a device that communicates in lines of text, for fuzzers: parsing never panics, each step advances, and no text
//! is accepted partially.
use super::fields::declared;
use super::frame::{Checksum, ChecksumForm, FRAME_MAX, Framing, ScannedFrame, Sum};
use super::pattern::Pattern;
use device::Slot;
use serde_json::{Value, json};
use std::sync::LazyLock;

/// Total length in bytes of the fields of [`PATTERNS`]: a number, a word, letters, a hexadecimal number.
const READINGS: usize = 32;

static FRAMINGS: LazyLock<Vec<Framing>> = LazyLock::new(|| {
    let framing =
        |start: &[u8], length: Option<usize>, end: &[u8], checksum: Option<Checksum>| Framing { start: start.to_vec(), length, end: end.to_vec(), checksum };
    let checksum = |sum, written, mark: &[u8]| Some(Checksum { sum, written, mark: mark.to_vec() });
    vec![
        framing(b"$", None, b"\r\n", checksum(Sum::Xor, ChecksumForm::Hex, b"*")),
        framing(b"", None, b"\n", None),
        framing(b"\x02", Some(6), b"\x03", checksum(Sum::Sum, ChecksumForm::Byte, b"")),
        framing(b"ab", Some(0), b"ba", None),
        framing(b"", Some(3), b"", None),
    ]
});

static PATTERNS: LazyLock<Vec<Pattern>> = LazyLock::new(|| {
    let of = |name: &str| {
        let (offset, declaration) = match name {
            "weight" => (0, json!({ "unit": "kg" })),
            "stable" => (8, json!({ "when": "ST" })),
            "code" => (16, json!({ "text": 6 })),
            _ => (24, json!({ "base": 16, "scale": 0.5, "offset": 1.0 })),
        };
        let (_, field) = declared(name, Some(&declaration as &Value), false)?;
        Ok(super::fields::Field { slot: Slot { offset, ..field.slot }, ..field })
    };
    let texts = ["{stable},{weight}kg", "{code}", "{}:{hex}{weight}", "{weight},{code};", "GP{},{weight}"];
    texts.iter().map(|text| Pattern::parse(text, of).expect("it is right")).collect()
});

/// Parses bytes; the first one selects the framing of texts.
pub fn text(bytes: &[u8]) {
    let Some((which, mut rest)) = bytes.split_first() else { return };
    let framing = &FRAMINGS[usize::from(*which) % FRAMINGS.len()];
    while !rest.is_empty() {
        let len = match framing.scan(rest) {
            ScannedFrame::Wait => break,
            ScannedFrame::Noise(len) | ScannedFrame::Damaged(len) | ScannedFrame::TooLong(len) => len,
            ScannedFrame::Frame(text, len) => {
                let again = framing.framed(text);
                assert_eq!(framing.scan(&again), ScannedFrame::Frame(text, again.len()), "what is framed again is read again");
                PATTERNS.iter().for_each(|pattern| taken(pattern, text));
                len
            }
        };
        assert!((1..=rest.len()).contains(&len), "it goes on, and takes no more than there is");
        rest = &rest[len..];
    }
    assert!(rest.len() < FRAME_MAX, "it does not wait for ever");
}

fn taken(pattern: &Pattern, text: &[u8]) {
    let mut readings = [0xAA; READINGS];
    let is_of = pattern.take(text, &mut readings);
    assert!(is_of || readings == [0xAA; READINGS], "nothing is half taken");
    let _: Option<Vec<u8>> = pattern.write(&readings);
}
