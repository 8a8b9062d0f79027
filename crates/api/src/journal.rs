// SPDX-License-Identifier: Apache-2.0
//! Rules by which a journal, from which a restarted daemon restores its configuration, treats a call.

/// Journal entry for a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JournalEntry {
    /// No entry, because the call only observes, or affects only this run of the daemon.
    Nothing,
    /// Later outcome for the instances that the call started, but not the call itself.
    Outcome,
    /// The call itself, which a replay of the journal repeats.
    Call,
}

/// Rules by which a journal and its replay treat a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JournalRule {
    pub recorded: JournalEntry,
    /// Arguments that identify a setting: among calls with the same values of these arguments, only the last one counts.
    pub replaces: Option<&'static [&'static str]>,
    /// Call that deletes the item created by this one, and the argument of this call that names the item.
    pub goes_with: Option<(&'static str, &'static str)>,
    /// True if nothing may be started after replaying the call has failed, because a safeguard that would stop a motion is missing.
    pub watches: bool,
    /// Arguments that must not be written to a file.
    pub secret: &'static [&'static str],
}
