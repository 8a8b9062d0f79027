// SPDX-License-Identifier: Apache-2.0
//! Decoder of x86-64 instructions, limited to their length and to their effect on floating-point state. Compiled code is decoded
//! instruction by instruction, so that bytes of an address or a constant are not mistaken for an instruction. An invalid byte counts as
//! an instruction of one byte.

/// Instruction at an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    pub len: usize,
    pub changes_floats: bool,
}

/// Decodes the instruction at the start of `code`, which must not be empty.
pub fn read(code: &[u8]) -> Instruction {
    Reader { code, at: 0, operand_16: false, address_32: false, repeated: false, wide: false }.read().unwrap_or(Instruction { len: 1, changes_floats: false })
}

struct Reader<'a> {
    code: &'a [u8],
    at: usize,
    operand_16: bool,
    address_32: bool,
    repeated: bool,
    wide: bool,
}

/// Operand byte (ModRM) after an opcode.
#[derive(Clone, Copy)]
struct Operand {
    register: u8,
    is_memory: bool,
}

impl Reader<'_> {
    fn read(mut self) -> Option<Instruction> {
        let changes_floats = self.instruction()?;
        (self.at <= self.code.len()).then_some(Instruction { len: self.at, changes_floats })
    }

    fn next(&mut self) -> Option<u8> {
        let byte = self.code.get(self.at).copied();
        self.at += 1;
        byte
    }

    fn instruction(&mut self) -> Option<bool> {
        let mut opcode = self.next()?;
        loop {
            match opcode {
                0x66 => self.operand_16 = true,
                0x67 => self.address_32 = true,
                0xf2 | 0xf3 => self.repeated = true,
                0x26 | 0x2e | 0x36 | 0x3e | 0x64 | 0x65 | 0xf0 => {}
                _ => break,
            }
            opcode = self.next()?;
        }
        if opcode & 0xf0 == 0x40 {
            self.wide = opcode & 8 != 0;
            opcode = self.next()?;
        }
        match opcode {
            0x0f => self.two_bytes(),
            0xc5 => {
                self.next()?;
                let opcode = self.next()?;
                self.vector(1, opcode)
            }
            0xc4 => {
                let map = self.next()? & 0x1f;
                self.next()?;
                let opcode = self.next()?;
                self.vector(map, opcode)
            }
            0x62 => {
                let map = self.next()? & 7;
                self.at += 2;
                let opcode = self.next()?;
                self.vector(map, opcode)
            }
            _ => self.one_byte(opcode),
        }
    }

    /// Decodes the rest of an instruction after a vector prefix.
    fn vector(&mut self, map: u8, opcode: u8) -> Option<bool> {
        if map == 1 && opcode == 0x77 {
            return Some(false);
        }
        let operand = self.operand()?;
        if map == 3 || map == 1 && has_byte_behind(opcode) {
            self.at += 1;
        }
        Some(map == 1 && opcode == 0xae && operand.is_memory && operand.register == 2)
    }

    /// Reads a register or memory operand with its displacement.
    fn operand(&mut self) -> Option<Operand> {
        let byte = self.next()?;
        let (mode, memory) = (byte >> 6, byte & 7);
        if mode != 3 {
            let base = if memory == 4 { self.next()? & 7 } else { memory };
            self.at += match mode {
                1 => 1,
                2 => 4,
                _ if base == 5 => 4,
                _ => 0,
            };
        }
        Some(Operand { register: byte >> 3 & 7, is_memory: mode != 3 })
    }

    fn immediate(&self) -> usize {
        if self.operand_16 { 2 } else { 4 }
    }

    fn one_byte(&mut self, opcode: u8) -> Option<bool> {
        match opcode {
            // Arithmetic in blocks of eight: four with an operand, two with a constant.
            0x00..=0x3f if opcode & 7 < 4 => drop(self.operand()?),
            0x00..=0x3f if opcode & 7 == 4 => self.at += 1,
            0x00..=0x3f if opcode & 7 == 5 => self.at += self.immediate(),
            0x63 | 0x84..=0x8f | 0xd0..=0xd3 | 0xfe | 0xff => drop(self.operand()?),
            0x68 => self.at += self.immediate(),
            0x69 | 0x81 | 0xc7 => {
                self.operand()?;
                self.at += self.immediate();
            }
            0x6b | 0x80 | 0x82 | 0x83 | 0xc0 | 0xc1 | 0xc6 => {
                self.operand()?;
                self.at += 1;
            }
            0x6a | 0x70..=0x7f | 0xa8 | 0xb0..=0xb7 | 0xcd | 0xe0..=0xe7 | 0xeb => self.at += 1,
            0xa0..=0xa3 => self.at += if self.address_32 { 4 } else { 8 },
            0xa9 => self.at += self.immediate(),
            0xb8..=0xbf => self.at += if self.wide { 8 } else { self.immediate() },
            0xc2 | 0xca => self.at += 2,
            0xc8 => self.at += 3,
            0xe8 | 0xe9 => self.at += 4,
            0xf6 | 0xf7 => {
                let operand = self.operand()?;
                if operand.register < 2 {
                    self.at += if opcode == 0xf6 { 1 } else { self.immediate() };
                }
            }
            // fldenv and fldcw; frstor.
            0xd8..=0xdf => {
                let operand = self.operand()?;
                return Some(operand.is_memory && matches!((opcode, operand.register), (0xd9, 4 | 5) | (0xdd, 4)));
            }
            _ => {}
        }
        Some(false)
    }

    fn two_bytes(&mut self) -> Option<bool> {
        let opcode = self.next()?;
        match opcode {
            0x05..=0x09 | 0x0b | 0x0e | 0x30..=0x37 | 0x77 | 0xa0..=0xa2 | 0xa8..=0xaa | 0xc8..=0xcf => Some(false),
            0x38 => {
                let opcode = self.next()?;
                self.operand()?;
                Some(opcode < 0x20 && !self.operand_16)
            }
            0x3a => {
                self.next()?;
                self.operand()?;
                self.at += 1;
                Some(false)
            }
            0x80..=0x8f => {
                self.at += 4;
                Some(false)
            }
            _ => {
                let operand = self.operand()?;
                if has_byte_behind(opcode) {
                    self.at += 1;
                }
                // fxrstor, ldmxcsr, xrstor.
                let restores = opcode == 0xae && operand.is_memory && matches!(operand.register, 1 | 2 | 5);
                Some(restores || self.is_mmx(opcode))
            }
        }
    }

    /// Returns true if the instruction, without a prefix, uses the MMX registers, which alias the x87 stack.
    fn is_mmx(&self, opcode: u8) -> bool {
        let of_either = matches!(opcode, 0x60..=0x6b | 0x6e..=0x76 | 0x7e..=0x7f | 0xd1..=0xd5 | 0xd7..=0xef | 0xf1..=0xfe) && opcode != 0xe6;
        (of_either && !self.operand_16 && !self.repeated) || (matches!(opcode, 0x2a | 0x2c | 0x2d) && !self.repeated)
    }
}

fn has_byte_behind(opcode: u8) -> bool {
    matches!(opcode, 0x70..=0x73 | 0xa4 | 0xac | 0xba | 0xc2 | 0xc4..=0xc6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_compilers_make_is_read_to_its_end() {
        let instructions: [(&[u8], bool); 18] = [
            (&[0x66, 0x0f, 0x3a, 0x0f, 0xda, 0x0f], false),
            (&[0x55], false),
            (&[0x48, 0x89, 0xe5], false),
            (&[0x48, 0x8b, 0x05, 1, 2, 3, 4], false),
            (&[0x48, 0xb8, 0x0f, 0xae, 0x17, 0, 0, 0, 0, 0], false),
            (&[0xc7, 0x44, 0x24, 8, 0xd9, 0x28, 0, 0], false),
            (&[0x66, 0x0f, 0x6f, 0x44, 0x24, 0x10], false),
            (&[0xf2, 0x0f, 0x2a, 0xc0], false),
            (&[0x0f, 0xae, 0xe8], false),
            (&[0x0f, 0xae, 0x5c, 0x24, 0xfc], false),
            (&[0xc5, 0xf8, 0x77], false),
            (&[0xc4, 0xe3, 0x7d, 0x19, 0xc1, 1], false),
            (&[0x0f, 0xae, 0x54, 0x24, 0xfc], true),
            (&[0xc5, 0xf8, 0xae, 0x17], true),
            (&[0xd9, 0x6c, 0x24, 0xfe], true),
            (&[0xdd, 0x27], true),
            (&[0x0f, 0xef, 0xc0], true),
            (&[0x49, 0x0f, 0xae, 0x2c, 0x24], true),
        ];
        for (bytes, changes_floats) in instructions {
            let with_more = [bytes, &[0x90, 0x90]].concat();
            assert_eq!(read(&with_more), Instruction { len: bytes.len(), changes_floats }, "{bytes:02x?}");
        }
    }

    #[test]
    fn what_is_cut_off_is_one_byte() {
        assert_eq!(read(&[0x0f, 0xae, 0x54, 0x24]), Instruction { len: 1, changes_floats: false });
        assert_eq!(read(&[0x48]), Instruction { len: 1, changes_floats: false });
    }
}
