// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// Falling edge: y = not u and u_before.
///
/// True, and reported, for the single invocation in which the input changes from true to false; the input counts as false before the
/// first invocation. Source: IEC 61131-3, F_TRIG.
#[derive(FunctionBlock)]
pub struct FallingEdge {
    /// input
    #[input]
    u: bool,
    /// true at an edge
    #[output]
    y: bool,
    /// an edge has occurred
    #[condition]
    edge: Condition,
    /// input in the previous invocation
    #[state]
    before: bool,
}

impl Step for FallingEdge {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = !self.u && self.before;
        if self.y {
            self.edge.report();
        }
        self.before = self.u;
        Outcome::Done
    }
}
