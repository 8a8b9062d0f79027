// SPDX-License-Identifier: Apache-2.0
//! Text of a C++ exception that escaped the body of a block.

use crate::abi::outcome;

/// Copy of the text, created without allocation on the real-time path.
#[derive(Clone, Copy)]
pub struct What {
    bytes: [u8; outcome::WHAT_MAX],
    len: usize,
}

impl What {
    /// Returns the text that belongs to an entry's result; empty if the result is not an exception.
    ///
    /// # Safety
    /// `result` must have been returned by an entry of a module in this process.
    pub unsafe fn of(result: u64) -> What {
        let mut what = What { bytes: [0; outcome::WHAT_MAX], len: 0 };
        if result & outcome::MASK != outcome::THREW {
            return what;
        }
        let text = (result >> outcome::SHIFT) as usize as *const u8;
        while !text.is_null() && what.len < outcome::WHAT_MAX {
            // SAFETY: the text ends with a 0 that is never overwritten, and lies in a module, which stays. Another thread may write
            // what its own exception says: then the text is mixed, and as long.
            let byte = unsafe { text.add(what.len).read_volatile() };
            if byte == 0 {
                break;
            }
            what.bytes[what.len] = byte;
            what.len += 1;
        }
        what
    }

    /// Returns the bytes of the text.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
    }

    /// Returns the text, with invalid UTF-8 replaced.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(self.bytes()).into_owned()
    }
}
