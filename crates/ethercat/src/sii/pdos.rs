// SPDX-License-Identifier: Apache-2.0
//! Process data objects (PDOs) in an EEPROM: the named entries that a subdevice exchanges.
use crate::coe::Entry;
use crate::frames::u16_at;

/// Size of a PDO header, and of each PDO entry, bytes.
const ROW: usize = 8;
/// Value that marks a PDO that is not exchanged unless a main device assigns it.
const UNASSIGNED: u8 = 0xFF;

/// A PDO listed in the EEPROM.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pdo {
    pub index: u16,
    /// SyncManager that exchanges the PDO; `None` if it is not exchanged by default.
    pub manager: Option<u8>,
    pub name: String,
    pub entries: Vec<PdoEntry>,
}

/// An entry of a PDO.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PdoEntry {
    /// Object dictionary entry; index 0 for a gap.
    pub of: Entry,
    pub bits: u8,
    /// CoE data type number: 1 BOOL, 3 INTEGER16, …
    pub kind: u8,
    pub name: String,
}

/// Parses a PDO category; an incomplete PDO ends the list.
pub fn parse(body: &[u8], strings: &[String]) -> Vec<Pdo> {
    let text = |index: u8| usize::from(index).checked_sub(1).and_then(|at| strings.get(at)).cloned().unwrap_or_default();
    let mut pdos = Vec::new();
    let mut rows = body.chunks_exact(ROW);
    while let Some(head) = rows.next() {
        let mut entries = Vec::new();
        for row in rows.by_ref().take(head[2].into()) {
            let of = Entry { index: u16_at(row, 0), sub: row[2] };
            entries.push(PdoEntry { of, bits: row[5], kind: row[4], name: text(row[3]) });
        }
        if entries.len() < usize::from(head[2]) {
            break;
        }
        let manager = (head[3] != UNASSIGNED).then_some(head[3]);
        pdos.push(Pdo { index: u16_at(head, 0), manager, name: text(head[5]), entries });
    }
    pdos
}

/// Encodes a PDO category; `number` returns the index of a string in the Strings category.
pub fn write(pdos: &[Pdo], mut number: impl FnMut(&str) -> u8) -> Vec<u8> {
    let mut body = Vec::new();
    for pdo in pdos {
        let ([low, high], name) = (pdo.index.to_le_bytes(), number(&pdo.name));
        body.extend([low, high, pdo.entries.len() as u8, pdo.manager.unwrap_or(UNASSIGNED), 0, name, 0, 0]);
        for entry in &pdo.entries {
            let ([low, high], name) = (entry.of.index.to_le_bytes(), number(&entry.name));
            body.extend([low, high, entry.of.sub, name, entry.kind, entry.bits, 0, 0]);
        }
    }
    body
}
