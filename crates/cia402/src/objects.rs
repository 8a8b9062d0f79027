// SPDX-License-Identifier: Apache-2.0
//! Object dictionary entries of a device, and the reasons why it denies access to one.

/// Object dictionary entry: index and subindex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Entry {
    pub index: u16,
    pub sub: u8,
}

impl Entry {
    /// Returns the entry in the format of a process data mapping: index, subindex and length in bits, packed into one number.
    pub const fn mapped(self, bits: u8) -> u32 {
        (self.index as u32) << 16 | (self.sub as u32) << 8 | bits as u32
    }
}

/// Returns the meaning of an SDO abort code.
pub fn abort_name(code: u32) -> &'static str {
    match code {
        0x0503_0000 => "toggle bit not changed",
        0x0504_0000 => "SDO protocol timeout",
        0x0504_0001 => "command not valid or unknown",
        0x0504_0005 => "out of memory",
        0x0601_0000 => "unsupported access to an object",
        0x0601_0001 => "attempt to read a write-only object",
        0x0601_0002 => "attempt to write a read-only object",
        0x0601_0003 => "subindex cannot be written while subindex 0 is not 0",
        0x0601_0004 => "complete access not supported",
        0x0602_0000 => "the object does not exist",
        0x0604_0041 => "the object cannot be mapped",
        0x0604_0042 => "the mapped objects are longer than a PDO",
        0x0604_0043 => "general parameter incompatibility",
        0x0606_0000 => "access failed due to a hardware error",
        0x0607_0010 => "the length does not match",
        0x0607_0012 => "the length is too large",
        0x0607_0013 => "the length is too small",
        0x0609_0011 => "the subindex does not exist",
        0x0609_0030 => "the value is out of range",
        0x0609_0031 => "the value is too large",
        0x0609_0032 => "the value is too small",
        0x0800_0000 => "general error",
        0x0800_0020 => "data cannot be transferred or stored",
        0x0800_0021 => "data cannot be stored because of local control",
        0x0800_0022 => "data cannot be stored in the present state",
        _ => "a vendor-specific code",
    }
}
