// SPDX-License-Identifier: Apache-2.0
//! Lists that can be reached by transitions.
use crate::conditions::ENDS;
use crate::definition::{Transition, Verb};
use indexmap::IndexSet;

/// Returns lists and all lists that can be reached from them by transitions that `follows` accepts.
pub(super) fn reached(verb: &Verb, from: IndexSet<String>, follows: impl Fn(&Transition) -> bool) -> IndexSet<String> {
    let mut found = from;
    let mut at = 0;
    while let Some(list) = found.get_index(at).cloned() {
        found.extend(verb.transitions.iter().filter(|line| line.from == list && follows(line)).map(|line| line.to.clone()));
        at += 1;
    }
    found
}

/// Returns true for a transition by a condition that orders the verb to end.
pub(super) fn ends(line: &Transition) -> bool {
    ENDS.contains(&line.condition.as_str())
}
