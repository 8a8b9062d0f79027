// SPDX-License-Identifier: Apache-2.0
//! A check: its name, the sentence that holds where it passes, and how it is tried.
use super::subject::Subject;

pub(super) struct Check {
    pub(super) name: &'static str,
    pub(super) sentence: &'static str,
    pub(super) run: fn(&Subject) -> CheckResult,
}

/// Result of a check: it passed, or it does not apply, or the cause of its failure.
pub(super) type CheckResult = Result<PassedCheck, String>;

/// Form of a passed check.
pub(super) enum PassedCheck {
    Yes,
    /// It says nothing about this driver: why.
    NotApplicable(&'static str),
}

/// Of a check of parts, where there are none.
pub(super) const NO_PARTS: PassedCheck = PassedCheck::NotApplicable("it has no parts");

/// Passes where the condition holds; else the cause.
pub(super) fn holds(condition: bool, cause: impl FnOnce() -> String) -> CheckResult {
    if condition { Ok(PassedCheck::Yes) } else { Err(cause()) }
}

/// Passes where nothing was found wrong.
pub(super) fn none_of(mut wrong: impl Iterator<Item = String>) -> CheckResult {
    wrong.next().map_or(Ok(PassedCheck::Yes), Err)
}
