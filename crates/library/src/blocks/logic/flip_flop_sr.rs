// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Flip-flop, set first: q = set or (q and not reset).
///
/// A one-bit memory; if both inputs are true, set wins. It starts false. Source: IEC 61131-3, SR.
#[derive(FunctionBlock)]
pub struct FlipFlopSr {
    /// sets q to true
    #[input]
    set: bool,
    /// sets q to false
    #[input]
    reset: bool,
    /// stored value
    #[output]
    q: bool,
}

impl Step for FlipFlopSr {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.q = self.set || (self.q && !self.reset);
        Outcome::Done
    }
}
