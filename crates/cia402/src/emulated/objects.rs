// SPDX-License-Identifier: Apache-2.0
//! Object dictionary of an emulated drive.
use crate::objects::Entry;

/// Access of the main device to an object dictionary entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    Constant,
    /// Written only by the drive.
    Measured,
    Written,
    /// Written by the main device in PREOP.
    Configured,
}

struct Object {
    of: Entry,
    access: Access,
    value: Vec<u8>,
}

/// Abort codes.
const NO_OBJECT: u32 = 0x0602_0000;
const NO_SUBINDEX: u32 = 0x0609_0011;
const READ_ONLY: u32 = 0x0601_0002;
const NOT_NOW: u32 = 0x0800_0022;
const TOO_LONG: u32 = 0x0607_0012;
const TOO_SHORT: u32 = 0x0607_0013;
const NOT_MAPPABLE: u32 = 0x0604_0041;

/// Objects by index and subindex. The length of a value never changes.
#[derive(Default)]
pub struct Objects {
    all: Vec<Object>,
}

/// Location of an object in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handle(usize);

/// A mapped object: its location, and its length in bytes.
#[derive(Clone, Copy, Debug)]
pub struct MappedObject {
    pub of: Handle,
    pub len: usize,
}

impl Objects {
    pub fn add(&mut self, index: u16, sub: u8, access: Access, value: &[u8]) -> Handle {
        self.all.push(Object { of: Entry { index, sub }, access, value: value.to_vec() });
        Handle(self.all.len() - 1)
    }

    /// Returns the object at an index and subindex, or an abort code.
    pub fn find(&self, of: Entry) -> Result<Handle, u32> {
        let found = self.all.iter().position(|object| object.of == of).map(Handle);
        let is_known = || self.all.iter().any(|object| object.of.index == of.index);
        found.ok_or_else(|| if is_known() { NO_SUBINDEX } else { NO_OBJECT })
    }

    pub fn value(&self, at: Handle) -> &[u8] {
        &self.all[at.0].value
    }

    /// Returns a value as a signed number.
    pub fn number(&self, at: Handle) -> i64 {
        let value = self.value(at);
        let is_negative = value.last().is_some_and(|byte| byte & 0x80 != 0);
        let mut eight = [if is_negative { 0xFF } else { 0 }; 8];
        eight[..value.len().min(8)].copy_from_slice(&value[..value.len().min(8)]);
        i64::from_le_bytes(eight)
    }

    /// Returns a value of up to 4 bytes as an unsigned number.
    pub fn bits(&self, at: Handle) -> u32 {
        self.number(at) as u32 & u32::MAX.checked_shr(32 - 8 * self.value(at).len().min(4) as u32).unwrap_or(0)
    }

    pub fn set_number(&mut self, at: Handle, value: i64) {
        let to = &mut self.all[at.0].value;
        let len = to.len();
        to.copy_from_slice(&value.to_le_bytes()[..len]);
    }

    /// Sets a value from the process data.
    pub fn set_value(&mut self, at: Handle, value: &[u8]) {
        self.all[at.0].value.copy_from_slice(value);
    }

    /// Writes a value on behalf of the main device; fails with the abort code if this is refused.
    pub fn write(&mut self, of: Entry, value: &[u8], in_preop: bool) -> Result<(), u32> {
        let at = self.find(of)?;
        let object = &self.all[at.0];
        match object.access {
            Access::Constant | Access::Measured => return Err(READ_ONLY),
            Access::Configured if !in_preop => return Err(NOT_NOW),
            _ => {}
        }
        match value.len().cmp(&object.value.len()) {
            std::cmp::Ordering::Greater => return Err(TOO_LONG),
            std::cmp::Ordering::Less => return Err(TOO_SHORT),
            std::cmp::Ordering::Equal => {}
        }
        let is_mapping = matches!(of.index >> 8, 0x16 | 0x17 | 0x1A | 0x1B) && of.sub > 0;
        if is_mapping {
            self.mapped(u32::from_le_bytes([value[0], value[1], value[2], value[3]])).ok_or(NOT_MAPPABLE)?;
        }
        self.set_value(at, value);
        Ok(())
    }

    /// Returns the objects mapped by the PDO assignment of a direction (0x1C12 outputs, 0x1C13 inputs), in order; `None` if one of them
    /// does not exist.
    pub fn mapping(&self, assignment: u16) -> Option<Vec<MappedObject>> {
        let count = |index| self.find(Entry { index, sub: 0 }).ok().map(|at| self.bits(at));
        let at = |index, sub: u32| self.find(Entry { index, sub: sub as u8 }).ok().map(|at| self.bits(at));
        let mut mapped = Vec::new();
        for pdo in 1..=count(assignment)? {
            let pdo = at(assignment, pdo)? as u16;
            for entry in 1..=count(pdo)? {
                mapped.push(self.mapped(at(pdo, entry)?)?);
            }
        }
        Some(mapped)
    }

    /// Parses an index, subindex and length in bits packed into one number.
    fn mapped(&self, word: u32) -> Option<MappedObject> {
        let of = self.find(Entry { index: (word >> 16) as u16, sub: (word >> 8) as u8 }).ok()?;
        let len = self.value(of).len();
        (8 * len == (word & 0xFF) as usize).then_some(MappedObject { of, len })
    }
}
