// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Flip-flop, reset first: q = not reset and (set or q).
///
/// A memory of one bit; where both inputs are true, reset wins. It begins false. Source: IEC 61131-3, RS.
#[derive(FunctionBlock)]
pub struct FlipFlopRs {
    /// makes q true
    #[input]
    set: bool,
    /// makes q false
    #[input]
    reset: bool,
    /// the value that was set last
    #[output]
    q: bool,
}

impl Step for FlipFlopRs {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.q = !self.reset && (self.set || self.q);
        Outcome::Done
    }
}
