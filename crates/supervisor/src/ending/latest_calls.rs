// SPDX-License-Identifier: Apache-2.0
//! Calls for the latest end reports.
use crate::ending::latest::End;
use crate::system::System;

impl System {
    /// Returns the end reports starting at number `since`, oldest first, to the extent that they are among the last 1,024. If the first
    /// number is above `since`, older reports were dropped.
    pub fn ends_since(&self, since: u64) -> Vec<End> {
        let core = self.shared.locked();
        let first = core.observation.ends.kept.front().map_or(0, |end| end.number);
        let skipped = usize::try_from(since.saturating_sub(first)).unwrap_or(usize::MAX);
        core.observation.ends.kept.iter().skip(skipped).cloned().collect()
    }
}
