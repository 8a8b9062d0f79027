// SPDX-License-Identifier: Apache-2.0
//! A check: its name, the sentence that is true if it passes, and its function.
use super::subject::Subject;

pub(super) struct Check {
    pub(super) name: &'static str,
    pub(super) sentence: &'static str,
    pub(super) run: fn(&Subject) -> CheckResult,
}

/// Result of a check: passed or not applicable, or the cause of its failure.
pub(super) type CheckResult = Result<PassedCheck, String>;

/// Variant of a passed check.
pub(super) enum PassedCheck {
    Yes,
    /// The check does not apply to this driver, for this reason.
    NotApplicable(&'static str),
}

/// Result of a check of parts if the driver has none.
pub(super) const NO_PARTS: PassedCheck = PassedCheck::NotApplicable("it has no parts");

/// Passes if the condition holds; otherwise fails with the cause.
pub(super) fn holds(condition: bool, cause: impl FnOnce() -> String) -> CheckResult {
    if condition { Ok(PassedCheck::Yes) } else { Err(cause()) }
}

/// Passes if there are no problems; otherwise fails with the first.
pub(super) fn none_of(mut wrong: impl Iterator<Item = String>) -> CheckResult {
    wrong.next().map_or(Ok(PassedCheck::Yes), Err)
}
