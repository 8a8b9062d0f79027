// SPDX-License-Identifier: Apache-2.0
//! The latest end reports of all instances, numbered, for a programming system that was not there when they came.
use crate::report::Report;
use crate::system::System;
use serde::Serialize;
use std::collections::VecDeque;

/// Ends kept.
const ENDS_MAX: usize = 1024;

/// One end of one start.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct End {
    /// Counted from 0 over the life of the system.
    pub number: u64,
    pub instance: u64,
    pub report: Report,
}

#[derive(Default)]
pub(crate) struct Ends {
    kept: VecDeque<End>,
    next: u64,
}

impl Ends {
    pub fn add(&mut self, instance: u64, report: Report) {
        if self.kept.len() == ENDS_MAX {
            self.kept.pop_front();
        }
        self.kept.push_back(End { number: self.next, instance, report });
        self.next += 1;
    }
}

impl Ends {
    /// Number of the next end.
    pub fn next(&self) -> u64 {
        self.next
    }
}

impl System {
    /// End reports from number `since` on, oldest first: those of the last 1,024 ends. A first number above `since` shows what is gone.
    pub fn ends_since(&self, since: u64) -> Vec<End> {
        let core = self.shared.locked();
        let first = core.ends.kept.front().map_or(0, |end| end.number);
        let skipped = usize::try_from(since.saturating_sub(first)).unwrap_or(usize::MAX);
        core.ends.kept.iter().skip(skipped).cloned().collect()
    }
}
