// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Sign: y = 1 if u > 0, -1 if u < 0, 0 if u = 0.
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
        // NaN propagates so that it is detected.
        self.y = if self.u == 0.0 { 0.0 } else { self.u.signum() };
        Outcome::Done
    }
}
