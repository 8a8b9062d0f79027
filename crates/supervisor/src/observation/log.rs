// SPDX-License-Identifier: Apache-2.0
//! The log: commands with their callers, conditions, faults, transitions, starts and ends. Only the last few thousand entries are kept.
use crate::observation::commanded::{AnnouncedCommand, LatestCommands};
use model::wording::printable;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

/// Maximum number of entries. If there are more, the oldest entry of the most frequent subject is dropped: jogging displaces jogging, not
/// the fault before it.
const ENTRIES_MAX: usize = 4096;

#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "LogEntry"))]
pub struct Entry {
    pub sequence: u64,
    pub time_s: f64,
    /// Kind of the entry: `start`, `admission`, `exchange`, `end`, `condition`, `transition`, `ending`, `fault`, `overrun`, `late`,
    /// `device`, `processor_lost`, `emergency_stop`, `lost`, `journal`, `control`, `recorder`, `module`, `command`.
    pub kind: &'static str,
    /// Verb instance, device or source to which the entry refers.
    pub about: String,
    pub text: String,
    /// Caller of a command: `program` for the program of which this system is a part, or a session or caller of the control interface;
    /// otherwise empty.
    pub who: String,
}

/// Kind and subject of an entry; `jog` stands for all instances `jog#1`, `jog#2`, ….
type Subject = Arc<(&'static str, String)>;

#[derive(Default)]
pub(crate) struct Log {
    entries: BTreeMap<Subject, VecDeque<Entry>>,
    /// Number of entries per subject, ascending: entries of the last subject are dropped first.
    counts: BTreeSet<(usize, Subject)>,
    kept: usize,
    next: u64,
    commanded: LatestCommands,
    /// Commands that may still be refused.
    announced: Vec<AnnouncedCommand>,
    /// Number of commands registered as in progress so far.
    announcements: u64,
}

impl Log {
    pub fn add(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>) {
        self.add_of(time_ns, kind, about, text, "");
    }

    /// Adds an entry caused by a caller. A command in progress thereby has an effect, so its own entry is added first.
    pub fn add_of(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>, who: &str) {
        self.enter_announced();
        self.push(time_ns, kind, about, text, who);
    }

    fn push(&mut self, time_ns: i64, kind: &'static str, about: &str, text: impl Into<String>, who: &str) {
        if self.kept == ENTRIES_MAX {
            self.make_room();
        }
        let about = printable(about);
        let subject = Arc::new((kind, about.split_once('#').map_or(about.as_str(), |(verb, _)| verb).to_owned()));
        let of = self.entries.entry(Arc::clone(&subject)).or_default();
        let counted = self.counts.take(&(of.len(), Arc::clone(&subject))).map_or(subject, |(_, known)| known);
        self.counts.insert((of.len() + 1, counted));
        of.push_back(Entry { sequence: self.next, time_s: time_ns as f64 * 1e-9, kind, about, text: printable(text), who: printable(who) });
        self.kept += 1;
        self.next += 1;
    }

    /// Drops the oldest entry of the most frequent subject.
    fn make_room(&mut self) {
        let Some((count, subject)) = self.counts.pop_last() else { return };
        let Some(of) = self.entries.get_mut(&subject) else { return };
        of.pop_front();
        self.kept -= 1;
        if of.is_empty() {
            self.entries.remove(&subject);
        } else {
            self.counts.insert((count - 1, subject));
        }
    }

    /// Returns the number of the next entry.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Returns the entries starting at number `sequence`.
    pub fn since(&self, sequence: u64) -> Vec<Entry> {
        let new = |of: &VecDeque<Entry>| of.range(of.partition_point(|entry| entry.sequence < sequence)..).cloned().collect::<Vec<_>>();
        let mut since: Vec<Entry> = self.entries.values().flat_map(new).collect();
        since.sort_unstable_by_key(|entry| entry.sequence);
        since
    }
}

const PROGRAM: &str = "program";

impl Log {
    /// Adds a command, with the reason for its refusal if it was refused.
    pub fn command(&mut self, who: &str, call: &str, about: &str, refused: Option<&str>, now_ns: i64) {
        let Some(before) = self.commanded.enter(who, call, about, refused.is_some(), now_ns) else { return };
        let refused = refused.map(|why| format!(" was refused: {why}")).unwrap_or_default();
        let times = if before > 0 { format!(", and {before} more times since it was last logged") } else { String::new() };
        self.push(now_ns, "command", about, format!("{call}{refused}{times}"), who);
    }

    /// Registers a command of the program as in progress, and returns its number.
    pub fn announce(&mut self, call: &str, about: &str, time_ns: i64) -> u64 {
        self.announcements += 1;
        self.announced.push(AnnouncedCommand { number: self.announcements, call: call.to_owned(), about: about.to_owned(), time_ns });
        self.announcements
    }

    /// Records that a command has completed or was refused.
    pub fn settle(&mut self, number: u64, call: &str, about: &str, refused: Option<&str>, now_ns: i64) {
        let announced = self.announced.iter().position(|announced| announced.number == number).map(|at| self.announced.remove(at));
        match (announced, refused) {
            (Some(announced), None) => self.command(PROGRAM, call, about, None, announced.time_ns),
            (_, Some(why)) => self.command(PROGRAM, call, about, Some(why), now_ns),
            (None, None) => {}
        }
    }

    /// Adds the commands in progress.
    pub fn enter_announced(&mut self) {
        for of in std::mem::take(&mut self.announced) {
            self.command(PROGRAM, &of.call, &of.about, None, of.time_ns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_often_pushes_out_itself_and_not_what_came_before() {
        let mut log = Log::default();
        log.add(0, "fault", "arm.elbow", "the position is 0.3 from its commanded position");
        for press in 0..10_000 {
            log.add(press, "start", &format!("jog#{press}"), "");
            log.add(press, "end", &format!("jog#{press}"), "halted");
        }
        log.add(10_000, "start", "move#1", "");
        let entries = log.since(0);
        assert_eq!(entries.len(), ENTRIES_MAX);
        assert!(entries.is_sorted_by_key(|entry| entry.sequence));
        assert_eq!((entries[0].kind, entries.last().map(|last| last.about.as_str())), ("fault", Some("move#1")));
        assert_eq!(log.since(log.next() - 2).iter().map(|entry| entry.about.as_str()).collect::<Vec<_>>(), ["jog#9999", "move#1"]);
        // With as many subjects as entries, the oldest entry of a subject that has two is dropped.
        for about in 0..ENTRIES_MAX {
            log.add(0, "device", &format!("d{about}"), "");
        }
        assert_eq!((log.since(0).len(), log.kept), (ENTRIES_MAX, ENTRIES_MAX));
        let counts: BTreeSet<(usize, Subject)> = log.entries.iter().map(|(subject, of)| (of.len(), Arc::clone(subject))).collect();
        assert_eq!(log.counts, counts);
    }
}
