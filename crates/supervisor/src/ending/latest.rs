// SPDX-License-Identifier: Apache-2.0
//! Latest end reports of all instances, numbered, for a programming system that was not connected when they were created.
use crate::ending::report::Report;
use serde::Serialize;
use std::collections::VecDeque;

/// Number of end reports to keep.
const ENDS_MAX: usize = 1024;

/// End of one start.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct End {
    /// Number of the end, counted from 0 over the lifetime of the system.
    pub number: u64,
    pub instance: u64,
    pub report: Report,
}

#[derive(Default)]
pub(crate) struct Ends {
    pub kept: VecDeque<End>,
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
    /// Returns the number of the next end.
    pub fn next(&self) -> u64 {
        self.next
    }
}
