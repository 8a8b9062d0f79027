// SPDX-License-Identifier: Apache-2.0
//! Process data objects: which objects of a drive they carry, and where in them each is.
use cia402::{Entry, Mode};

/// An object in a PDO: index, subindex and bits in one number, as a mapping has it.
pub type Word = u32;

pub const CONTROL: Word = 0x6040_0010;
pub const STATUS: Word = 0x6041_0010;
pub const POSITION: Word = 0x6064_0020;
pub const VELOCITY: Word = 0x606C_0020;
pub const TORQUE: Word = 0x6077_0010;
pub const ERROR: Word = 0x603F_0010;

/// One PDO of a node: its objects in their order, at most 8 bytes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pdo {
    pub words: Vec<Word>,
}

/// What the controller sends to a drive: PDO 1.
pub fn outputs(mode: Mode) -> Pdo {
    let target = match mode {
        Mode::Velocity => 0x60FF_0020,
        Mode::Torque => 0x6071_0010,
        Mode::Position | Mode::Homing => 0x607A_0020,
    };
    Pdo { words: vec![CONTROL, target] }
}

/// What a drive sends: PDO 1 and 2.
pub fn inputs() -> [Pdo; 2] {
    [Pdo { words: vec![STATUS, POSITION, TORQUE] }, Pdo { words: vec![VELOCITY, ERROR] }]
}

/// Whether a drive may lack it.
pub fn is_optional(word: Word) -> bool {
    matches!(word, TORQUE | VELOCITY | ERROR)
}

/// The entry of an object.
pub fn entry(word: Word) -> Entry {
    Entry { index: (word >> 16) as u16, sub: (word >> 8) as u8 }
}

impl Pdo {
    /// Bytes.
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| len(*word)).sum()
    }

    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// Where an object begins; none: it is not there.
    pub fn at(&self, of: Word) -> Option<usize> {
        let place = self.words.iter().position(|word| *word == of)?;
        Some(self.words[..place].iter().map(|word| len(*word)).sum())
    }
}

fn len(word: Word) -> usize {
    (word & 0xFF) as usize / 8
}

/// A signed number of 2 or 4 bytes in process data; 0 where it is not. Real-time safe.
pub fn number(bytes: &[u8], at: Option<usize>, len: usize) -> i32 {
    let part = at.and_then(|at| bytes.get(at..at + len));
    match part {
        Some([a, b]) => i32::from(i16::from_le_bytes([*a, *b])),
        Some([a, b, c, d]) => i32::from_le_bytes([*a, *b, *c, *d]),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_a_drive_fits_into_three_frames() {
        let [first, second] = inputs();
        assert_eq!((outputs(Mode::Position).len(), first.len(), second.len()), (6, 8, 6));
        assert_eq!((first.at(STATUS), first.at(TORQUE), second.at(ERROR), first.at(ERROR)), (Some(0), Some(6), Some(4), None));
        assert_eq!(number(&[0, 0, 0xFE, 0xFF], Some(2), 2), -2);
        assert_eq!(number(&[0, 0], Some(1), 4), 0);
    }
}
