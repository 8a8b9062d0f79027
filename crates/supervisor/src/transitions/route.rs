// SPDX-License-Identifier: Apache-2.0
//! Route of one start through its command lists: the conditions that led to another list, and the outputs that they returned.
use crate::ending::report::PassedList;
use crate::instances::captures::Captures;
use crate::instances::cause::Cause;
use crate::instances::installed_verb::InstalledVerb;
use std::collections::VecDeque;

/// Maximum number of steps in a report. For a verb that cycles for days, only the last ones are kept.
const TOLD_MAX: usize = 64;

/// Route of one start: its transitions, in order.
#[derive(Default)]
pub(crate) struct Way {
    passed: VecDeque<PassedList>,
    /// Distinct conditions that led to another list, by index, ordered by their most recent occurrence.
    pub conditions: Vec<usize>,
    /// Outputs that these conditions return, with their values at the transition.
    pub captures: Captures,
}

impl Way {
    /// Records a transition from a list because of a condition; values that the condition returned earlier are discarded as outdated.
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

    /// Returns the steps in the format of a report.
    pub fn told(&self) -> Vec<PassedList> {
        self.passed.iter().cloned().collect()
    }
}
