// SPDX-License-Identifier: Apache-2.0
//! The way of one start through its command lists: which conditions led on, and what those returned.
use crate::lifecycle::instance::{Cause, Piece};
use crate::lifecycle::outputs::{take_captured, take_outputs};
use crate::lifecycle::report::Passed;
use crate::lifecycle::stages::Verbatim;
use kernel::SourceId;
use std::collections::VecDeque;

/// Steps that a report tells. A verb that goes round for days keeps the last ones.
const TOLD_MAX: usize = 64;

/// The transitions of one start, in order.
#[derive(Default)]
pub(crate) struct Way {
    passed: VecDeque<Passed>,
    /// Conditions that led on, by index, each once, in the order in which they came last.
    pub conditions: Vec<usize>,
    /// Values of what those return, as they were when they led on.
    pub outputs: Vec<(Piece, Vec<u8>)>,
    /// Outputs that the script under way captures in each source, in order.
    pub capturing: Vec<(SourceId, Vec<Piece>)>,
}

impl Way {
    /// A condition leads on from a list; what it returned before is out of date.
    pub fn lead_on(&mut self, of: &Verbatim, list: usize, cause: &Cause) {
        let condition = &of.plan.conditions[cause.condition];
        if self.passed.len() == TOLD_MAX {
            self.passed.pop_front();
        }
        self.passed.push_back(Passed {
            command_list: of.plan.lists[list].name.clone(),
            condition: condition.name.clone(),
            block: cause.block.clone(),
            time_s: cause.time_ns as f64 * 1e-9,
        });
        self.conditions.retain(|before| *before != cause.condition);
        self.conditions.push(cause.condition);
        self.outputs.retain(|((output, _), _)| !condition.returns.contains(output));
        self.capturing.clear();
    }

    /// What a kernel's reaction captured in `source`.
    pub fn take(&mut self, of: &Verbatim, source: SourceId, condition: usize, captured: &[u8]) {
        let outputs = of.outputs_in(source, condition);
        let lens: Vec<usize> = outputs.iter().map(|piece| of.piece_len(*piece)).collect();
        take_outputs(&mut self.outputs, &outputs, &lens, captured);
    }

    /// What scripts of the supervisor captured.
    pub fn take_scripts(&mut self, of: &Verbatim, captured: Vec<(SourceId, Vec<u8>)>) {
        take_captured(of, &mut self.outputs, &mut self.capturing, captured);
    }

    pub fn told(&self) -> Vec<Passed> {
        self.passed.iter().cloned().collect()
    }
}
