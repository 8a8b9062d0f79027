// SPDX-License-Identifier: Apache-2.0
//! What a journal makes of a call, so that a daemon that starts again knows what it was told.

/// What a journal records when a call was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recorded {
    /// Nothing: it only looks, or is of this life of the daemon alone.
    Nothing,
    /// What has become of that which runs, not the call itself.
    Outcome,
    /// The call, which a replay of the journal makes again.
    Call,
}

/// How a journal, and its replay, treat a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Journalled {
    pub recorded: Recorded,
    /// Of the calls with the same values of these arguments only the last one counts.
    pub replaces: Option<&'static [&'static str]>,
    /// The call that deletes what this one made, and the argument of this one that names it.
    pub goes_with: Option<(&'static str, &'static str)>,
    /// Where a replay of it fails, nothing is started: what would stop a motion is not there.
    pub watches: bool,
    /// Arguments that no file may have.
    pub secret: &'static [&'static str],
}
