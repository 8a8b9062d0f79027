// SPDX-License-Identifier: Apache-2.0
//! The log: commands and who gave them, conditions, faults, transitions, starts and ends, the last few thousand.
use crate::commanded::{Announced, Commanded};
use serde::Serialize;
use std::collections::VecDeque;

/// Entries kept.
const ENTRIES_MAX: usize = 4096;

#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Entry {
    pub sequence: u64,
    pub time_s: f64,
    /// `start`, `admission`, `exchange`, `end`, `condition`, `transition`, `ending`, `fault`, `overrun`, `late`, `device`, `processor_lost`, `emergency_stop`, `lost`, `journal`, `recorder`, `command`.
    pub kind: &'static str,
    /// The verb instance, device or source it is about.
    pub about: String,
    pub text: String,
    /// Of a command who gave it: `program`, the program that this system is part of, or a session or caller of the control interface;
    /// else empty.
    pub who: String,
}

#[derive(Default)]
pub(crate) struct Log {
    entries: VecDeque<Entry>,
    next: u64,
    pub commanded: Commanded,
    /// Commands of which it is not known yet whether they are refused.
    pub announced: Vec<Announced>,
    /// How many there have been.
    pub announcements: u64,
}

impl Log {
    pub fn add(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>) {
        self.add_of(time_ns, kind, about, text, "");
    }

    /// An entry of something that somebody gave. A command that is under way has had an effect then, and comes before that.
    pub fn add_of(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>, who: &str) {
        self.enter_announced();
        self.push(time_ns, kind, about, text, who);
    }

    pub fn push(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>, who: &str) {
        if self.entries.len() == ENTRIES_MAX {
            self.entries.pop_front();
        }
        self.entries.push_back(Entry {
            sequence: self.next,
            time_s: time_ns as f64 * 1e-9,
            kind,
            about: about.to_owned(),
            text: text.into(),
            who: who.to_owned(),
        });
        self.next += 1;
    }

    /// Number of the next entry.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Entries from number `sequence` on.
    pub fn since(&self, sequence: u64) -> Vec<Entry> {
        self.entries.iter().filter(|e| e.sequence >= sequence).cloned().collect()
    }
}
