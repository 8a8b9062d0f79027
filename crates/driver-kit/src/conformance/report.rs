// SPDX-License-Identifier: Apache-2.0
//! Report of the conformance kit.
use serde_json::{Value, json};
use std::fmt;

/// Result of a check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    Passed,
    /// Cause of the failure.
    Failed(String),
    /// The check does not apply to this driver, for this reason.
    NotApplicable(String),
}

/// A check and its outcome.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    pub check: String,
    /// Sentence that is true if the check passes.
    pub sentence: String,
    pub verdict: Verdict,
}

/// All checks in order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    pub driver: String,
    pub outcomes: Vec<Outcome>,
}

impl Verdict {
    /// Returns the machine-readable name of the verdict.
    pub fn text(&self) -> &'static str {
        match self {
            Verdict::Passed => "passed",
            Verdict::Failed(_) => "failed",
            Verdict::NotApplicable(_) => "not applicable",
        }
    }
}

impl Outcome {
    /// Returns the word and the text to print after the check's name.
    fn said(&self) -> (&'static str, String) {
        match &self.verdict {
            Verdict::Passed => ("passed", self.sentence.clone()),
            Verdict::Failed(cause) => ("FAILED", format!("{}: {cause}", self.sentence)),
            Verdict::NotApplicable(why) => ("-", format!("{} ({why})", self.sentence)),
        }
    }
}

impl Report {
    /// Returns the failed checks, each with its cause.
    pub fn failed(&self) -> Vec<(&str, &str)> {
        let failed = self.outcomes.iter().filter_map(|outcome| match &outcome.verdict {
            Verdict::Failed(cause) => Some((outcome.check.as_str(), cause.as_str())),
            _ => None,
        });
        failed.collect()
    }

    /// Returns the report as JSON, for programs.
    pub fn json(&self) -> Value {
        let outcomes = self.outcomes.iter().map(|outcome| {
            let why = match &outcome.verdict {
                Verdict::Passed => "",
                Verdict::Failed(why) | Verdict::NotApplicable(why) => why.as_str(),
            };
            json!({ "check": outcome.check, "sentence": outcome.sentence, "verdict": outcome.verdict.text(), "why": why })
        });
        json!({ "driver": self.driver, "passed": self.failed().is_empty(), "checks": outcomes.collect::<Vec<_>>(), "text": self.to_string() })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for outcome in &self.outcomes {
            let (verdict, said) = outcome.said();
            writeln!(f, "{verdict:<7} {:<28} {said}", outcome.check)?;
        }
        let count = |of: fn(&Verdict) -> bool| self.outcomes.iter().filter(|outcome| of(&outcome.verdict)).count();
        let passed = count(|verdict| *verdict == Verdict::Passed);
        let apart = count(|verdict| matches!(verdict, Verdict::NotApplicable(_)));
        write!(f, "driver '{}': {passed} passed, {} failed, {apart} not applicable", self.driver, self.failed().len())
    }
}
