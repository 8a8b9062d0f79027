// SPDX-License-Identifier: Apache-2.0
//! Text of a C++ exception that left the body of a block.

use crate::abi::outcome;

/// A copy of it, without an allocation: the real-time path makes it.
#[derive(Clone, Copy)]
pub struct What {
    bytes: [u8; outcome::WHAT_MAX],
    len: usize,
}

impl What {
    /// Of what an entry returned; empty where that is no exception.
    ///
    /// # Safety
    /// An entry of a module in this process has returned `result`.
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

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
    }

    /// As text; what is no UTF-8 is replaced.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(self.bytes()).into_owned()
    }
}
