// SPDX-License-Identifier: Apache-2.0
//! Process data objects (PDOs): the drive objects that they carry, and the position of each.
use cia402::{Entry, Mode};

/// An object in a PDO: its index, subindex and length in bits, packed into one number as in a mapping.
pub type Word = u32;

pub const CONTROL: Word = 0x6040_0010;
pub const MODE: Word = 0x6060_0008;
pub const STATUS: Word = 0x6041_0010;
pub const POSITION: Word = 0x6064_0020;
pub const VELOCITY: Word = 0x606C_0020;
pub const TORQUE: Word = 0x6077_0010;
pub const ERROR: Word = 0x603F_0010;
pub const MODE_SHOWN: Word = 0x6061_0008;

/// Number of PDOs in each direction.
pub const PDOS: usize = 4;
/// Maximum length of a PDO, bytes.
pub const LEN_MAX: usize = 8;

/// A PDO of a node: its objects in order, at most 8 bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pdo {
    pub words: Vec<Word>,
}

/// PDOs of a node in one direction; a PDO without objects is unused.
pub type Pdos = [Pdo; PDOS];

/// Returns the target object of a drive in a mode.
pub fn target(mode: Mode) -> Word {
    match mode {
        Mode::Velocity => 0x60FF_0020,
        Mode::Torque => 0x6071_0010,
        Mode::Position | Mode::Homing => 0x607A_0020,
    }
}

/// Returns the PDOs that the controller sends to a drive: PDO 1, and PDO 2 if it controls a brake.
pub fn outputs(mode: Mode, brake: Option<Word>) -> Pdos {
    let mut pdos = Pdos::default();
    pdos[0].words = vec![CONTROL, target(mode), MODE];
    pdos[1].words = brake.into_iter().collect();
    pdos
}

/// Returns the PDOs that a drive sends: PDO 1 and 2.
pub fn inputs() -> Pdos {
    let mut pdos = Pdos::default();
    pdos[0].words = vec![STATUS, POSITION, TORQUE];
    pdos[1].words = vec![VELOCITY, ERROR, MODE_SHOWN];
    pdos
}

/// Returns true if the object is optional in a drive.
pub fn is_optional(word: Word) -> bool {
    matches!(word, TORQUE | VELOCITY | ERROR | MODE | MODE_SHOWN)
}

/// Returns the object dictionary entry of a mapped object.
pub fn entry(word: Word) -> Entry {
    Entry { index: (word >> 16) as u16, sub: (word >> 8) as u8 }
}

impl Pdo {
    /// Returns the length in bytes.
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| len(*word)).sum()
    }

    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// Returns the offset of an object, or `None` if it is not mapped.
    pub fn at(&self, of: Word) -> Option<usize> {
        let place = self.words.iter().position(|word| *word == of)?;
        Some(self.words[..place].iter().map(|word| len(*word)).sum())
    }
}

/// Returns the length of a mapped object in bytes.
pub fn len(word: Word) -> usize {
    (word & 0xFF) as usize / 8
}

/// Returns an object in process data as a signed number of 1, 2 or 4 bytes, or `None` if it is not mapped. Real-time safe.
pub fn number(bytes: &[u8], pdo: &Pdo, of: Word) -> Option<i32> {
    let at = pdo.at(of)?;
    match bytes.get(at..at + len(of))? {
        [a] => Some((*a as i8).into()),
        [a, b] => Some(i16::from_le_bytes([*a, *b]).into()),
        [a, b, c, d] => Some(i32::from_le_bytes([*a, *b, *c, *d])),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_a_drive_fits_into_four_frames() {
        let [first, second, ..] = inputs();
        let [told, brake, ..] = outputs(Mode::Position, Some(0x60FE_0120));
        assert_eq!((told.len(), brake.len(), first.len(), second.len()), (7, 4, 8, 7));
        assert_eq!((first.at(STATUS), first.at(TORQUE), second.at(ERROR), first.at(ERROR)), (Some(0), Some(6), Some(4), None));
        let bytes = [0x37, 0x02, 0xFE, 0xFF, 0xFF, 0xFF, 5, 0];
        assert_eq!((number(&bytes, &first, POSITION), number(&bytes, &first, ERROR), number(&bytes[..5], &first, POSITION)), (Some(-2), None, None));
    }
}
