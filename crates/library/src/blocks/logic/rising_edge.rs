// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// Rising edge: y = u and not u_before.
///
/// True, and reported, for the single invocation in which the input changes from false to true; the input counts as false before the
/// first invocation. Source: IEC 61131-3, R_TRIG.
#[derive(FunctionBlock)]
pub struct RisingEdge {
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

impl Step for RisingEdge {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u && !self.before;
        if self.y {
            self.edge.report();
        }
        self.before = self.u;
        Outcome::Done
    }
}
