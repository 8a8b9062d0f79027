// SPDX-License-Identifier: Apache-2.0
//! Route of one start through its command lists: the conditions that led to another list, and the outputs that they returned.
use crate::ending::report::PassedList;
use crate::instances::captures::Captures;
use crate::instances::cause::Cause;
use crate::instances::installed_verb::InstalledVerb;
use kernel::SourceId;
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
    before_take: Option<BeforeTake>,
}

/// Position at which the supervisor last took the process. A kernel may have made transitions from there that it reports only afterwards.
struct BeforeTake {
    generation: u32,
    list: usize,
    /// Number of steps recorded since then.
    steps: usize,
    /// Distinct conditions of these steps.
    conditions: Vec<usize>,
}

impl Way {
    /// Records a transition from a list because of a condition; values that the condition returned earlier are discarded as outdated.
    pub fn lead_on(&mut self, of: &InstalledVerb, list: usize, cause: &Cause) {
        self.insert(of, list, cause, 0);
        self.conditions.retain(|before| *before != cause.condition);
        self.conditions.push(cause.condition);
        self.captures.forget(&of.plan.conditions[cause.condition].returns);
        self.captures.expect_nothing();
        if let Some(before) = &mut self.before_take {
            before.steps += 1;
            if !before.conditions.contains(&cause.condition) {
                before.conditions.push(cause.condition);
            }
        }
    }

    /// Notes that the supervisor takes a process of this generation, whose last reported list is `list`.
    pub fn process_taken(&mut self, generation: u32, list: usize) {
        self.before_take = Some(BeforeTake { generation, list, steps: 0, conditions: Vec::new() });
    }

    /// Records a transition to `list` that a kernel made before the supervisor took the process, and that is reported only now: its step
    /// precedes those recorded since. Returns false if there is no such transition in `generation`.
    pub fn lead_on_before(&mut self, of: &InstalledVerb, generation: u32, list: usize, cause: &Cause, source: SourceId, captured: &[u8]) -> bool {
        let Some(before) = self.before_take.as_mut().filter(|before| before.generation == generation) else { return false };
        let (from, steps, later) = (std::mem::replace(&mut before.list, list), before.steps, before.conditions.clone());
        self.insert(of, from, cause, steps);
        if !later.contains(&cause.condition) {
            self.conditions.retain(|before| *before != cause.condition);
            let newer = self.conditions.iter().position(|before| later.contains(before)).unwrap_or(self.conditions.len());
            self.conditions.insert(newer, cause.condition);
        }
        let is_newer = |output: &usize| later.iter().any(|condition| of.plan.conditions[*condition].returns.contains(output));
        let returns: Vec<usize> = of.plan.conditions[cause.condition].returns.iter().copied().filter(|output| !is_newer(output)).collect();
        self.captures.forget(&returns);
        self.captures.take_of(of, &of.outputs_in(source, cause.condition), captured, &returns);
        true
    }

    /// Adds a step in front of the last `later` ones.
    fn insert(&mut self, of: &InstalledVerb, list: usize, cause: &Cause, later: usize) {
        if self.passed.len() == TOLD_MAX {
            self.passed.pop_front();
        }
        let step = PassedList {
            command_list: of.plan.lists[list].name.clone(),
            condition: of.plan.conditions[cause.condition].name.clone(),
            block: cause.block.clone(),
            time_s: cause.time_ns as f64 * 1e-9,
        };
        self.passed.insert(self.passed.len().saturating_sub(later), step);
    }

    /// Returns the steps in the format of a report.
    pub fn told(&self) -> Vec<PassedList> {
        self.passed.iter().cloned().collect()
    }
}
