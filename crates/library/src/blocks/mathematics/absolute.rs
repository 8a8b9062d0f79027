// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Absolute value: y = |u|.
#[derive(FunctionBlock)]
pub struct Absolute {
    /// input
    #[input]
    u: f64,
    /// absolute value
    #[output(unit = "=u")]
    y: f64,
}

impl Step for Absolute {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u.abs();
        Outcome::Done
    }
}
