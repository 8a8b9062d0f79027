// SPDX-License-Identifier: Apache-2.0
//! EEPROM of a subdevice, which describes it: identity, mailbox, name, SyncManagers, FMMUs, process data.
mod pdos;

use crate::frames::{put, u16_at, u32_at};
pub use pdos::{Pdo, PdoEntry};

/// Size of the fixed part of every EEPROM, bytes.
pub const FIXED: usize = 0x80;
const STRINGS: u16 = 10;
const GENERAL: u16 = 30;
const FMMUS: u16 = 40;
const SYNC_MANAGERS: u16 = 41;
const INPUTS: u16 = 50;
const OUTPUTS: u16 = 51;
const END: u16 = 0xFFFF;
const GENERAL_LEN: usize = 32;

/// Identity of a subdevice.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Identity {
    pub vendor: u32,
    pub product: u32,
    pub revision: u32,
    pub serial: u32,
    /// Configured station alias; 0 for none.
    pub alias: u16,
    pub name: String,
}

/// A SyncManager described in the EEPROM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SyncManager {
    pub start: u16,
    pub len: u16,
    pub control: u8,
    pub enable: u8,
    /// Kind: 1 mailbox out, 2 mailbox in, 3 process data outputs, 4 process data inputs.
    pub kind: u8,
}

/// Contents of an EEPROM, as far as a main device needs them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Contents {
    pub identity: Identity,
    pub has_coe: bool,
    pub sync_managers: Vec<SyncManager>,
    /// Kinds of FMMUs: 1 outputs, 2 inputs, 3 mailbox state.
    pub fmmus: Vec<u8>,
    /// PDOs that the subdevice sends. May be empty if it has a CoE object dictionary.
    pub inputs: Vec<Pdo>,
    /// PDOs that the subdevice receives. May be empty if it has a CoE object dictionary.
    pub outputs: Vec<Pdo>,
}

/// Parses an EEPROM image. It may end early; missing parts are omitted.
pub fn parse(bytes: &[u8]) -> Option<Contents> {
    if bytes.len() < FIXED {
        return None;
    }
    let mut contents = Contents { has_coe: u16_at(bytes, 0x38) & 4 != 0, ..Contents::default() };
    let identity = &mut contents.identity;
    (identity.vendor, identity.product) = (u32_at(bytes, 0x10), u32_at(bytes, 0x14));
    (identity.revision, identity.serial) = (u32_at(bytes, 0x18), u32_at(bytes, 0x1C));
    identity.alias = u16_at(bytes, 0x08);
    let mut name_index = 0;
    let mut strings: Vec<String> = Vec::new();
    // The names may follow the PDOs.
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    let mut at = FIXED;
    while at + 4 <= bytes.len() {
        let (kind, len) = (u16_at(bytes, at), 2 * usize::from(u16_at(bytes, at + 2)));
        let Some(body) = bytes.get(at + 4..at + 4 + len).filter(|_| kind != END) else { break };
        match kind {
            STRINGS => strings = read_strings(body),
            GENERAL => name_index = body.get(3).copied().unwrap_or(0),
            FMMUS => contents.fmmus = body.iter().copied().filter(|of| (1..=3).contains(of)).collect(),
            SYNC_MANAGERS => contents.sync_managers = body.chunks_exact(8).map(read_sync_manager).collect(),
            INPUTS => inputs.extend(body),
            OUTPUTS => outputs.extend(body),
            _ => {}
        }
        at += 4 + len;
    }
    contents.identity.name = usize::from(name_index).checked_sub(1).and_then(|index| strings.get(index).cloned()).unwrap_or_default();
    (contents.inputs, contents.outputs) = (pdos::parse(&inputs, &strings), pdos::parse(&outputs, &strings));
    Some(contents)
}

/// Returns the number of EEPROM bytes to read, judging by those read so far; `None` if it has been read completely.
pub fn wanted(bytes: &[u8]) -> Option<usize> {
    let mut at = FIXED;
    loop {
        if bytes.len() < at + 4 {
            return Some(at + 4);
        }
        if u16_at(bytes, at) == END || at > 0x4000 {
            return None;
        }
        at += 4 + 2 * usize::from(u16_at(bytes, at + 2));
    }
}

fn read_strings(body: &[u8]) -> Vec<String> {
    let mut strings = Vec::new();
    let mut rest = body.get(1..).unwrap_or_default();
    for _ in 0..body.first().copied().unwrap_or(0) {
        let Some((len, behind)) = rest.split_first() else { break };
        let Some(text) = behind.get(..usize::from(*len)) else { break };
        strings.push(text.iter().map(|byte| char::from(*byte)).filter(|c| !c.is_control()).collect());
        rest = &behind[usize::from(*len)..];
    }
    strings
}

fn read_sync_manager(eight: &[u8]) -> SyncManager {
    let (len, control, enable) = (u16_at(eight, 2), eight[4], eight[6]);
    let kind = match eight[7] {
        // Old EEPROMs omit the kind; the control byte then determines it: buffered, and the writing side.
        0 if enable & 1 != 0 && len > 0 && control & 3 == 0 => 4 - u8::from(control & 0x0C == 4),
        kind => kind,
    };
    SyncManager { start: u16_at(eight, 0), len, control, enable, kind }
}

/// Creates an EEPROM image with these contents. The first two SyncManagers are the mailboxes.
pub fn build(contents: &Contents) -> Vec<u8> {
    let mut bytes = vec![0; FIXED];
    let identity = &contents.identity;
    for (at, value) in [(0x10, identity.vendor), (0x14, identity.product), (0x18, identity.revision), (0x1C, identity.serial)] {
        put(&mut bytes, at, &value.to_le_bytes());
    }
    put(&mut bytes, 0x08, &identity.alias.to_le_bytes());
    bytes[0x0E] = check_sum(&bytes[..0x0E]);
    let mailboxes = contents.sync_managers.iter().filter(|manager| manager.kind <= 2);
    for (manager, at) in mailboxes.zip([0x30, 0x34]) {
        put(&mut bytes, at, &manager.start.to_le_bytes());
        put(&mut bytes, at + 2, &manager.len.to_le_bytes());
    }
    put(&mut bytes, 0x38, &(if contents.has_coe { 4u16 } else { 0 }).to_le_bytes());
    // The values mean 16 kbit, layout 1.
    put(&mut bytes, 0x7C, &[15, 0, 1, 0]);
    let mut strings = Strings(vec![identity.name.clone()]);
    let inputs = pdos::write(&contents.inputs, |text| strings.number(text));
    let outputs = pdos::write(&contents.outputs, |text| strings.number(text));
    let mut general = [0; GENERAL_LEN];
    (general[2], general[3]) = (1, 1);
    // The bits are SDO, SDO information, PDO assignment and configuration.
    general[5] = if contents.has_coe { 0x0D } else { 0 };
    let managers: Vec<u8> = contents.sync_managers.iter().flat_map(write_sync_manager).collect();
    let fixed = [(STRINGS, strings.bytes()), (GENERAL, general.to_vec()), (FMMUS, contents.fmmus.clone()), (SYNC_MANAGERS, managers)];
    let process_data = [(INPUTS, inputs), (OUTPUTS, outputs)].into_iter().filter(|(_, body)| !body.is_empty());
    for (kind, body) in fixed.into_iter().chain(process_data) {
        let words = body.len().div_ceil(2);
        bytes.extend(kind.to_le_bytes());
        bytes.extend((words as u16).to_le_bytes());
        bytes.extend(&body);
        bytes.resize(bytes.len() + 2 * words - body.len(), 0);
    }
    bytes.extend([0xFF; 4]);
    bytes
}

/// Table of strings, each stored once and numbered from 1.
struct Strings(Vec<String>);

impl Strings {
    /// Returns the number of a string; 0 for an empty string.
    fn number(&mut self, text: &str) -> u8 {
        if text.is_empty() {
            return 0;
        }
        let at = self.0.iter().position(|known| known == text).unwrap_or_else(|| {
            self.0.push(text.to_owned());
            self.0.len() - 1
        });
        u8::try_from(at + 1).unwrap_or(0)
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![self.0.len().min(255) as u8];
        for text in self.0.iter().take(255) {
            let text = &text.as_bytes()[..text.len().min(255)];
            bytes.push(text.len() as u8);
            bytes.extend(text);
        }
        bytes
    }
}

fn write_sync_manager(of: &SyncManager) -> [u8; 8] {
    let ([start, start_high], [len, len_high]) = (of.start.to_le_bytes(), of.len.to_le_bytes());
    [start, start_high, len, len_high, of.control, 0, of.enable, of.kind]
}

/// Returns the CRC with polynomial x⁸ + x² + x + 1, initialised with ones.
fn check_sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0xFF, |sum, byte| (0..8).fold(sum ^ byte, |sum: u8, _| if sum & 0x80 == 0 { sum << 1 } else { sum << 1 ^ 0x07 }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coe::Entry;
    use proptest::prelude::*;

    #[test]
    fn an_eeprom_is_read_as_it_was_written() {
        let manager = |start, kind| SyncManager { start, len: 128, control: 0x26, enable: 1, kind };
        let identity = Identity { vendor: 0x9999, product: 2, revision: 3, serial: 4, alias: 5, name: "drive".into() };
        let entry = |index, kind, bits, name: &str| PdoEntry { of: Entry { index, sub: 1 }, bits, kind, name: name.into() };
        let gap = PdoEntry { bits: 7, ..PdoEntry::default() };
        let inputs = vec![
            Pdo { index: 0x1A00, manager: Some(3), name: "Channel 1".into(), entries: vec![entry(0x6000, 1, 1, "Input"), gap] },
            Pdo { index: 0x1A01, manager: None, name: "Channel 2".into(), entries: vec![entry(0x6010, 3, 16, "Input")] },
        ];
        let outputs = vec![Pdo { index: 0x1600, manager: Some(2), name: String::new(), entries: vec![entry(0x7000, 5, 8, "drive")] }];
        let sync_managers = vec![manager(0x1000, 1), manager(0x1080, 2)];
        let contents = Contents { identity, has_coe: true, sync_managers, fmmus: vec![1, 2], inputs, outputs };
        let bytes = build(&contents);
        assert_eq!(parse(&bytes), Some(contents));
        assert_eq!(wanted(&bytes), None);
        assert_eq!(wanted(&bytes[..FIXED]), Some(FIXED + 4));
    }

    proptest! {
        #[test]
        fn no_bytes_are_too_wrong(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
            let _ = (parse(&bytes), wanted(&bytes));
        }
    }
}
