// SPDX-License-Identifier: Apache-2.0
//! The way of one start through its command lists: the conditions that led on, and what they returned.
use crate::ending::report::PassedList;
use crate::instances::captures::Captures;
use crate::instances::cause::Cause;
use crate::instances::installed_verb::InstalledVerb;
use std::collections::VecDeque;

/// Steps that a report tells. A verb that goes round for days keeps the last ones.
const TOLD_MAX: usize = 64;

/// The transitions of one start, in order.
#[derive(Default)]
pub(crate) struct Way {
    passed: VecDeque<PassedList>,
    /// Conditions that led on, by index, each once, in the order in which they came last.
    pub conditions: Vec<usize>,
    /// Outputs that those return, as they were when they led on.
    pub captures: Captures,
}

impl Way {
    /// Notes that a condition leads on from a list; what it returned before is out of date.
    pub fn lead_on(&mut self, of: &InstalledVerb, list: usize, cause: &Cause) {
        let condition = &of.plan.conditions[cause.condition];
        if self.passed.len() == TOLD_MAX {
            self.passed.pop_front();
        }
        self.passed.push_back(PassedList {
            command_list: of.plan.lists[list].name.clone(),
            condition: condition.name.clone(),
            block: cause.block.clone(),
            time_s: cause.time_ns as f64 * 1e-9,
        });
        self.conditions.retain(|before| *before != cause.condition);
        self.conditions.push(cause.condition);
        self.captures.forget(&condition.returns);
        self.captures.expect_nothing();
    }

    /// Returns the steps as a report tells them.
    pub fn told(&self) -> Vec<PassedList> {
        self.passed.iter().cloned().collect()
    }
}
