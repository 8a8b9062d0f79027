// SPDX-License-Identifier: Apache-2.0
//! Mapping of the objects that a subdevice exchanges in every cycle.
use super::bus::Bus;
use super::sdo::Mailbox;
use super::subdevices::Subdevice;
use crate::coe::Entry;
use crate::sii::{Contents, Pdo, SyncManager};

/// PDO assignment objects, each with the PDO that is assigned.
const OUTPUTS: (u16, u16) = (0x1C12, 0x1600);
const INPUTS: (u16, u16) = (0x1C13, 0x1A00);

/// An object in the process data of one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    pub of: Entry,
    /// Offset from the start, bits.
    pub at: usize,
    pub bits: usize,
}

/// Memory of a subdevice that contains process data of one direction, covered by one SyncManager.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    pub number: u16,
    pub manager: SyncManager,
    pub is_output: bool,
    /// Offset from the start of all data in this direction, and length, bytes.
    pub at: usize,
    pub len: usize,
}

/// Mapped objects of both directions.
#[derive(Clone, Debug, Default)]
pub struct Mapping {
    pub outputs: Vec<Field>,
    pub inputs: Vec<Field>,
    pub windows: Vec<Window>,
}

/// Kinds of SyncManagers for process data.
const OUTPUT_KIND: u8 = 3;
const INPUT_KIND: u8 = 4;

impl Mapping {
    /// Returns the number of output bytes and the number of input bytes.
    pub fn bytes(&self) -> (usize, usize) {
        let bytes = |fields: &[Field]| fields.last().map_or(0, |field| (field.at + field.bits).div_ceil(8));
        (bytes(&self.outputs), bytes(&self.inputs))
    }
}

/// Writes the mapping. Each object is its index, subindex and length in bits, packed into one number.
///
/// # Errors
/// Fails with a message if the subdevice rejects the mapping.
pub fn write(bus: &mut Bus, mailbox: &mut Mailbox, outputs: &[u32], inputs: &[u32]) -> Result<(), String> {
    for ((assignment, pdo), entries) in [(OUTPUTS, outputs), (INPUTS, inputs)] {
        let mut put = |index, sub, value: &[u8]| mailbox.download(bus, Entry { index, sub }, value);
        put(assignment, 0, &[0])?;
        put(pdo, 0, &[0])?;
        for (sub, entry) in (1..).zip(entries) {
            put(pdo, sub, &entry.to_le_bytes())?;
        }
        put(pdo, 0, &[entries.len() as u8])?;
        put(assignment, 1, &pdo.to_le_bytes())?;
        put(assignment, 0, &[1])?;
    }
    Ok(())
}

/// Reads the mapping.
///
/// # Errors
/// Fails with a message if the subdevice does not provide it.
pub fn read(bus: &mut Bus, subdevice: &Subdevice, mailbox: &mut Mailbox) -> Result<Mapping, String> {
    let (outputs, inputs) = (read_one(bus, mailbox, OUTPUTS.0)?, read_one(bus, mailbox, INPUTS.0)?);
    let mut mapping = Mapping { outputs, inputs, windows: Vec::new() };
    let (outputs, inputs) = mapping.bytes();
    for (kind, len) in [(OUTPUT_KIND, outputs), (INPUT_KIND, inputs)].into_iter().filter(|(_, len)| *len > 0) {
        let (number, manager) = subdevice.sync_manager(kind).ok_or("its EEPROM names no SyncManager for process data")?;
        mapping.windows.push(Window { number, manager, is_output: kind == OUTPUT_KIND, at: 0, len });
    }
    Ok(mapping)
}

/// Returns the process data that an EEPROM assigns to SyncManagers. Used for a subdevice without objects.
pub fn of_eeprom(contents: &Contents) -> Mapping {
    let mut mapping = Mapping::default();
    for (is_output, kind, pdos) in [(true, OUTPUT_KIND, &contents.outputs), (false, INPUT_KIND, &contents.inputs)] {
        let fields = if is_output { &mut mapping.outputs } else { &mut mapping.inputs };
        let mut at = 0;
        for (number, manager) in (0u8..).zip(&contents.sync_managers).filter(|(_, manager)| manager.kind == kind) {
            let before = at;
            for entry in pdos.iter().filter(|pdo: &&Pdo| pdo.manager == Some(number)).flat_map(|pdo| &pdo.entries) {
                fields.push(Field { of: entry.of, at, bits: entry.bits.into() });
                at += usize::from(entry.bits);
            }
            // Each SyncManager begins at a byte boundary.
            at = at.next_multiple_of(8);
            if at > before {
                let (before, len) = (before / 8, (at - before) / 8);
                mapping.windows.push(Window { number: number.into(), manager: *manager, is_output, at: before, len });
            }
        }
    }
    mapping
}

fn read_one(bus: &mut Bus, mailbox: &mut Mailbox, assignment: u16) -> Result<Vec<Field>, String> {
    let mut fields = Vec::new();
    let mut at = 0;
    for number in 1..=mailbox.number(bus, assignment, 0)?.min(32) {
        let pdo = mailbox.number(bus, assignment, number as u8)? as u16;
        for sub in 1..=mailbox.number(bus, pdo, 0)?.min(64) {
            let word = mailbox.number(bus, pdo, sub as u8)?;
            let bits = (word & 0xFF) as usize;
            fields.push(Field { of: Entry { index: (word >> 16) as u16, sub: (word >> 8) as u8 }, at, bits });
            at += bits;
        }
    }
    Ok(fields)
}
