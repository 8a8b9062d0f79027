// SPDX-License-Identifier: Apache-2.0
//! The latest end reports.
use crate::ending::latest::End;
use crate::system::System;

impl System {
    /// Returns end reports from number `since` on, oldest first: those of the last 1,024 ends. A first number above `since` shows what is gone.
    pub fn ends_since(&self, since: u64) -> Vec<End> {
        let core = self.shared.locked();
        let first = core.observation.ends.kept.front().map_or(0, |end| end.number);
        let skipped = usize::try_from(since.saturating_sub(first)).unwrap_or(usize::MAX);
        core.observation.ends.kept.iter().skip(skipped).cloned().collect()
    }
}
