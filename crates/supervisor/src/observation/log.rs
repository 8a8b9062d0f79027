// SPDX-License-Identifier: Apache-2.0
//! The log: commands with their callers, conditions, faults, transitions, starts and ends, the last few thousand.
use crate::observation::commanded::{Announced, Commanded};
use model::wording::printable;
use serde::Serialize;
use std::collections::VecDeque;

/// Entries kept.
const ENTRIES_MAX: usize = 4096;

#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "LogEntry"))]
pub struct Entry {
    pub sequence: u64,
    pub time_s: f64,
    /// `start`, `admission`, `exchange`, `end`, `condition`, `transition`, `ending`, `fault`, `overrun`, `late`, `device`, `processor_lost`, `emergency_stop`, `lost`, `journal`, `control`, `recorder`, `module`, `command`.
    pub kind: &'static str,
    /// The verb instance, device or source it is about.
    pub about: String,
    pub text: String,
    /// Caller of a command: `program`, the program that this system is part of, or a session or caller of the control interface;
    /// else empty.
    pub who: String,
}

#[derive(Default)]
pub(crate) struct Log {
    entries: VecDeque<Entry>,
    next: u64,
    commanded: Commanded,
    /// Commands of which it is not known yet whether they are refused.
    announced: Vec<Announced>,
    /// Number of announcements so far.
    announcements: u64,
}

impl Log {
    pub fn add(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>) {
        self.add_of(time_ns, kind, about, text, "");
    }

    /// Adds an entry made by a caller. A command under way has already had an effect by then, so its entry comes first.
    pub fn add_of(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>, who: &str) {
        self.enter_announced();
        self.push(time_ns, kind, about, text, who);
    }

    fn push(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>, who: &str) {
        if self.entries.len() == ENTRIES_MAX {
            self.entries.pop_front();
        }
        self.entries.push_back(Entry {
            sequence: self.next,
            time_s: time_ns as f64 * 1e-9,
            kind,
            about: printable(about),
            text: printable(text),
            who: printable(who),
        });
        self.next += 1;
    }

    /// Returns the number of the next entry.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Entries from number `sequence` on.
    pub fn since(&self, sequence: u64) -> Vec<Entry> {
        self.entries.iter().filter(|e| e.sequence >= sequence).cloned().collect()
    }
}

const PROGRAM: &str = "program";

impl Log {
    /// Enters a command, and why it was refused, where it was.
    pub fn command(&mut self, who: &str, call: &str, about: &str, refused: Option<&str>, now_ns: i64) {
        let Some(before) = self.commanded.enter(who, call, about, refused.is_some(), now_ns) else { return };
        let refused = refused.map(|why| format!(" was refused: {why}")).unwrap_or_default();
        let times = if before > 0 { format!(", and {before} times since the last line about it") } else { String::new() };
        self.push(now_ns, "command", about, format!("{call}{refused}{times}"), who);
    }

    /// Announces a command of the program, and returns its number.
    pub fn announce(&mut self, call: &str, about: &str, time_ns: i64) -> u64 {
        self.announcements += 1;
        self.announced.push(Announced { number: self.announcements, call: call.to_owned(), about: about.to_owned(), time_ns });
        self.announcements
    }

    /// Notes that a command is through, or refused.
    pub fn settle(&mut self, number: u64, call: &str, about: &str, refused: Option<&str>, now_ns: i64) {
        let announced = self.announced.iter().position(|announced| announced.number == number).map(|at| self.announced.remove(at));
        match (announced, refused) {
            (Some(announced), None) => self.command(PROGRAM, call, about, None, announced.time_ns),
            (_, Some(why)) => self.command(PROGRAM, call, about, Some(why), now_ns),
            (None, None) => {}
        }
    }

    /// Enters what is under way.
    pub fn enter_announced(&mut self) {
        for of in std::mem::take(&mut self.announced) {
            self.command(PROGRAM, &of.call, &of.about, None, of.time_ns);
        }
    }
}
