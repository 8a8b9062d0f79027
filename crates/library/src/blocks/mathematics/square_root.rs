// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Signed square root: y = sign(u) sqrt(|u|).
///
/// Makes a flow of a differential pressure, whichever way it goes.
#[derive(FunctionBlock)]
pub struct SquareRoot {
    /// input
    #[input]
    u: f64,
    /// its root, of its sign
    #[output]
    y: f64,
}

impl Step for SquareRoot {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u.abs().sqrt().copysign(self.u);
        Outcome::Done
    }
}
