// SPDX-License-Identifier: Apache-2.0
//! Treatment of a call by a journal, from which a restarted daemon restores its configuration.

/// Journal entry for a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JournalEntry {
    /// No entry: the call only observes, or concerns only this run of the daemon.
    Nothing,
    /// Later outcome of the instances that the call started, but not the call itself.
    Outcome,
    /// The call, which a replay of the journal repeats.
    Call,
}

/// Treatment of a call by a journal and its replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JournalRule {
    pub recorded: JournalEntry,
    /// Arguments that identify a setting: among calls with the same values of them, only the last one counts.
    pub replaces: Option<&'static [&'static str]>,
    /// Call that deletes the item created by this one, and the argument of this one that names the item.
    pub goes_with: Option<(&'static str, &'static str)>,
    /// True if nothing is started when the replay of the call fails, because something that would stop a motion is missing.
    pub watches: bool,
    /// Arguments that must not be written to a file.
    pub secret: &'static [&'static str],
}
