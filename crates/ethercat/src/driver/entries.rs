// SPDX-License-Identifier: Apache-2.0
//! Named entries of a terminal, as listed in its EEPROM or its vendor's file.
use super::options::{EntryOptions, PdoOptions};
use crate::coe::Entry;
use crate::sii::{Contents, Pdo};
use device::Number;

/// An entry that a terminal exchanges.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NamedEntry {
    /// Name in lower case, with underscores: `channel_1`, `ai_standard_channel_1_value`.
    pub name: String,
    /// Title in the vendor's spelling.
    pub title: String,
    pub of: Entry,
    pub bits: usize,
    pub number: Number,
    pub is_output: bool,
}

/// Maximum width of a channel value, bits.
const BITS_MAX: usize = 64;

/// Returns the entries listed in the EEPROM.
pub(super) fn of_eeprom(contents: &Contents) -> Vec<NamedEntry> {
    let list = |pdos: &[Pdo], is_output| -> Vec<PdoOptions> {
        let assigned = pdos.iter().filter(|pdo| pdo.manager.is_some());
        assigned.map(|pdo| PdoOptions { output: is_output, name: pdo.name.clone(), entries: pdo.entries.iter().map(EntryOptions::from).collect() }).collect()
    };
    of_pdos(&[list(&contents.inputs, false), list(&contents.outputs, true)].concat())
}

/// Returns the entries in a list of PDOs; skips gaps and entries that are not numbers.
pub(super) fn of_pdos(pdos: &[PdoOptions]) -> Vec<NamedEntry> {
    let mut all: Vec<NamedEntry> = Vec::new();
    for pdo in pdos {
        let entries: Vec<&EntryOptions> = pdo.entries.iter().filter(|entry| entry.index != 0 && (1..=BITS_MAX).contains(&entry.bits.into())).collect();
        for entry in &entries {
            let parts = if entries.len() == 1 && !pdo.name.is_empty() { vec![pdo.name.as_str()] } else { vec![pdo.name.as_str(), entry.name.as_str()] };
            let title = parts.iter().filter(|part| !part.is_empty()).copied().collect::<Vec<_>>().join(".");
            let plain = if title.is_empty() { format!("x{:04x}_{}", entry.index, entry.sub) } else { lower(&title) };
            let taken = |name: &str| all.iter().any(|other| other.name == name);
            let numbered = (2..).map(|number| format!("{plain}_{number}"));
            let name = std::iter::once(plain.clone()).chain(numbered).find(|name| !taken(name)).unwrap_or(plain);
            all.push(NamedEntry {
                name,
                title,
                of: Entry { index: entry.index, sub: entry.sub },
                bits: entry.bits.into(),
                number: number(entry.kind, entry.bits),
                is_output: pdo.output,
            });
        }
    }
    all
}

/// Returns the entry to which a text refers: by channel name, by its vendor's title, or by its object, `0x6000:1`.
pub(super) fn find<'a>(entries: &'a [NamedEntry], text: &str) -> Option<&'a NamedEntry> {
    let object = text.split_once(':').and_then(|(index, sub)| Some(Entry { index: whole(index)?, sub: u8::try_from(whole(sub)?).ok()? }));
    let name = lower(text);
    entries.iter().find(|entry| Some(entry.of) == object || object.is_none() && entry.name == name)
}

fn whole(text: &str) -> Option<u16> {
    let text = text.trim();
    text.strip_prefix("0x").map_or_else(|| text.parse().ok(), |digits| u16::from_str_radix(digits, 16).ok())
}

/// Converts a text to lower case, and replaces each run of characters other than letters and digits with an underscore.
fn lower(text: &str) -> String {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_").to_ascii_lowercase()
}

/// Returns the number type for a CoE data type; a type that is unknown or has a different width is treated as unsigned.
fn number(kind: u8, bits: u8) -> Number {
    match (kind, bits) {
        (_, 1) => Number::Bool,
        (0x02, 8) => Number::Int8,
        (0x03, 16) => Number::Int16,
        (0x04, 32) => Number::Int32,
        (0x15, 64) => Number::Int64,
        (0x08, 32) => Number::Float,
        (0x11, 64) => Number::Double,
        (_, ..=8) => Number::Uint8,
        (_, ..=16) => Number::Uint16,
        (_, ..=32) => Number::Uint32,
        _ => Number::Uint64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(index: u16, sub: u8, bits: u8, kind: u8, name: &str) -> EntryOptions {
        EntryOptions { index, sub, bits, kind, name: name.into() }
    }

    #[test]
    fn entries_are_found_by_name_title_and_object() {
        let analog = vec![
            entry(0x6000, 1, 1, 1, "Status__Underrange"),
            entry(0, 0, 15, 0, ""),
            entry(0x6000, 0x11, 16, 3, "Value"),
            entry(0x6000, 0x12, 96, 9, "Serial text"),
        ];
        let digital = |name: &str, index| PdoOptions { output: false, name: name.into(), entries: vec![entry(index, 1, 1, 1, "Input")] };
        let pdos = [
            PdoOptions { output: false, name: "AI Standard Channel 1".into(), entries: analog },
            digital("Channel 1", 0x6010),
            digital("Channel 1", 0x6020),
            digital("", 0x6030),
        ];
        let all = of_pdos(&pdos);
        let names: Vec<&str> = all.iter().map(|named| named.name.as_str()).collect();
        assert_eq!(names, ["ai_standard_channel_1_status_underrange", "ai_standard_channel_1_value", "channel_1", "channel_1_2", "input"]);
        assert_eq!((all[1].number, all[0].number, all[1].bits), (Number::Int16, Number::Bool, 16));
        for text in ["AI Standard Channel 1.Value", "ai_standard_channel_1_value", "0x6000:17", "0x6000:0x11"] {
            assert_eq!(find(&all, text), Some(&all[1]), "{text}");
        }
        assert_eq!(find(&all, "channel_2"), None);
    }
}
