// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Bias: y = u + b.
#[derive(FunctionBlock)]
pub struct Bias {
    /// input
    #[input]
    u: f64,
    /// input plus b
    #[output(unit = "=u")]
    y: f64,
    /// value to add
    #[param(default = 0.0, unit = "=u", range = "[-inf, inf)")]
    b: f64,
}

impl Step for Bias {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u + self.b;
        Outcome::Done
    }
}
