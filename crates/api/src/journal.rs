// SPDX-License-Identifier: Apache-2.0
//! Treatment of a call by a journal, so that a daemon that starts again knows what it was told.

/// Entry of a journal for a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JournalEntry {
    /// The journal records nothing: it only looks, or is of this life of the daemon alone.
    Nothing,
    /// Later outcome of what the call started, not the call itself.
    Outcome,
    /// The call, which a replay of the journal makes again.
    Call,
}

/// Treatment of a call by a journal and its replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JournalRule {
    pub recorded: JournalEntry,
    /// Arguments of which, among calls with the same values of them, only the last call counts.
    pub replaces: Option<&'static [&'static str]>,
    /// The call that deletes what this one made, and the argument of this one that names it.
    pub goes_with: Option<(&'static str, &'static str)>,
    /// Where a replay of it fails, nothing is started: what would stop a motion is not there.
    pub watches: bool,
    /// Arguments that no file may have.
    pub secret: &'static [&'static str],
}
