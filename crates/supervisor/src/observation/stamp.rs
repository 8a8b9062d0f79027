// SPDX-License-Identifier: Apache-2.0
//! Kernel stamps on the values of an activation.

/// A kernel stamp on an activation's values.
pub(crate) struct Stamp {
    pub number: u64,
    pub time_ns: i64,
    pub activated: u64,
}

impl Stamp {
    pub fn of(bytes: &[u8]) -> Stamp {
        let word = |at: usize| bytes.get(at..at + 8).and_then(|b| b.try_into().ok()).map_or(0, u64::from_le_bytes);
        Stamp { number: word(0), time_ns: word(8).cast_signed(), activated: word(16) }
    }

    /// Returns false if no invocation has stored the value.
    pub fn is_set(&self) -> bool {
        self.time_ns != kernel::NEVER_NS
    }

    /// Returns the number of the last invocation that stored a ratio output n; `None` if there was none. Such an output is stored at
    /// invocations n, 2n, … after the activation.
    pub fn stored(&self, n: u64) -> Option<u64> {
        let since = (self.number + 1).saturating_sub(self.activated);
        (since >= n).then(|| self.number - since % n.max(1))
    }
}
