// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Flip-flop, reset first: q = not reset and (set or q).
///
/// A one-bit memory; if both inputs are true, reset wins. It starts false. Source: IEC 61131-3, RS.
#[derive(FunctionBlock)]
pub struct FlipFlopRs {
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

impl Step for FlipFlopRs {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.q = !self.reset && (self.set || self.q);
        Outcome::Done
    }
}
