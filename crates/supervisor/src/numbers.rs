// SPDX-License-Identifier: Apache-2.0
//! Numbers that are never reused.

/// Source of the numbers of a system's instances, tickets, scripts and blocks.
#[derive(Default)]
pub(crate) struct Numbers(u64);

impl Numbers {
    pub fn fresh(&mut self) -> u64 {
        self.0 += 1;
        self.0
    }
}
