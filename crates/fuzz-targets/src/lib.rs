// SPDX-License-Identifier: Apache-2.0
//! Fuzz targets for the parsers of untrusted bytes, one function each. For arbitrary bytes, a target neither panics nor accepts input
//! that it would encode differently. `fuzz/` drives them with libFuzzer; the tests here replay the corpus and mutate it at random.
mod canopen;
mod control;
mod definitions;
mod ethercat;
mod exchange;
mod journal;
mod packets;
mod recordings;
mod schema;
mod scripts;

use indexmap::IndexMap;
use model::types::Type;

/// Function that takes arbitrary bytes.
pub type Target = fn(&[u8]);

/// All targets by name, which is also the name of their folder in `corpus`.
pub const TARGETS: &[(&str, Target)] = &[
    ("packets", packets::packets),
    ("types", types),
    ("definitions", definitions::definitions),
    ("modules", modules),
    ("frames", scripts::frames),
    ("parcels", scripts::parcels),
    ("journal", journal::journal),
    ("recordings", recordings::recordings),
    ("control", control::control),
    ("canopen", canopen::canopen),
    ("ethercat", ethercat::ethercat),
    ("modbus", drivers::any_bytes::modbus),
    ("servos", drivers::any_bytes::servos),
    ("text", drivers::any_bytes::text),
    ("rtde", drivers::any_bytes::rtde),
];

/// Fuzzes the type parser with a declaration and, on each further line, `name declaration` of a type that it may use. Checks that a
/// parsed type is parsed again as the same type.
fn types(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let mut lines = text.lines();
    let declaration = lines.next().unwrap_or_default();
    let known: IndexMap<String, String> =
        lines.filter_map(|line| line.split_once(' ')).map(|(name, declaration)| (name.to_string(), declaration.to_string())).collect();
    let Ok(read) = Type::parse_sized(declaration, &known, Some(3)) else { return };
    assert!(read.size().is_multiple_of(read.align()), "{declaration}: its size is whole alignments");
    let again = Type::parse(&read.normalised(), &IndexMap::new()).expect("a normalised declaration can be read");
    assert_eq!(read, again, "{declaration} is {}", read.normalised());
    if read.size() <= 1 << 16 {
        let zero = vec![0; read.size()];
        let value = read.decode(&zero);
        assert_eq!(read.encode(&value, "").expect("a value of its own is one of the type"), zero, "{declaration}");
    }
}

/// Fuzzes the parser of shared objects.
fn modules(bytes: &[u8]) {
    let _ = modules::elf::check(bytes);
}
