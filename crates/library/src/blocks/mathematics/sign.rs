// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Sign: y = 1 where u > 0, -1 where u < 0, 0 where u = 0.
#[derive(FunctionBlock)]
pub struct Sign {
    /// input
    #[input]
    u: f64,
    /// -1, 0 or 1
    #[output]
    y: f64,
}

impl Step for Sign {
    fn step(&mut self, _: &Invocation) -> Outcome {
        // What is no number stays so, to be found.
        self.y = if self.u == 0.0 { 0.0 } else { self.u.signum() };
        Outcome::Done
    }
}
