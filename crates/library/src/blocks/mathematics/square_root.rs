// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Signed square root: y = sign(u) sqrt(|u|).
///
/// Converts a differential pressure to a flow, in either direction.
#[derive(FunctionBlock)]
pub struct SquareRoot {
    /// input
    #[input]
    u: f64,
    /// root of |u|, with the sign of u
    #[output]
    y: f64,
}

impl Step for SquareRoot {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u.abs().sqrt().copysign(self.u);
        Outcome::Done
    }
}
