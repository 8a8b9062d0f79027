// SPDX-License-Identifier: Apache-2.0
//! Termination of a run when an invariant is violated.
use model::refusal::Refusals;

/// A violated invariant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokenInvariant {
    pub invariant: &'static str,
    pub text: String,
}

pub fn broken<T>(invariant: &'static str, text: impl Into<String>) -> Result<T, BrokenInvariant> {
    Err(BrokenInvariant { invariant, text: text.into() })
}

/// Formats refusals as one line.
pub fn text(refusals: &Refusals) -> String {
    refusals.iter().map(|refusal| format!("{:?}: {refusal}", refusal.class)).collect::<Vec<_>>().join("; ")
}
