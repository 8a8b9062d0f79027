// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// Awaits a digital value: reports `done` if u = value; with `edge`, only if u had the other value in the previous invocation.
#[derive(FunctionBlock)]
pub struct AwaitDigital {
    /// monitored value
    #[input]
    u: bool,
    /// latest value
    #[output]
    latest: bool,
    /// awaited value
    #[param(default = true)]
    value: bool,
    /// true: the input must change to that value; its initial value does not count
    #[param(default = false)]
    edge: bool,
    /// the input has the awaited value
    #[condition]
    done: Condition,
    /// true if the input differed from the awaited value in the previous invocation
    #[state]
    was_other: bool,
}

impl Step for AwaitDigital {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.latest = self.u;
        if self.u == self.value && (!self.edge || self.was_other) {
            self.done.report();
        }
        self.was_other = self.u != self.value;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the invocations in which the block reports `done` for these values.
    fn reports(values: &[bool], value: bool, edge: bool) -> Vec<usize> {
        let mut block = AwaitDigital { u: false, latest: false, value, edge, done: Condition::new(), was_other: false };
        let report = |u: &bool| {
            (block.u, block.done) = (*u, Condition::new());
            assert_eq!(block.step(&Invocation::default()), Outcome::Done);
            assert_eq!(block.latest, *u);
            block.done.is_reported()
        };
        values.iter().map(report).enumerate().filter(|(_, reported)| *reported).map(|(k, _)| k).collect()
    }

    #[test]
    fn a_level_counts_at_once_and_an_edge_when_it_comes() {
        let values = [true, true, false, true, true, false];
        assert_eq!(reports(&values, true, false), [0, 1, 3, 4]);
        assert_eq!(reports(&values, false, false), [2, 5]);
        assert_eq!(reports(&values, true, true), [3]);
        assert_eq!(reports(&values, false, true), [2, 5]);
    }
}
