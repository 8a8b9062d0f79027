// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// First-order low-pass filter: y += alpha (u - y).
#[derive(FunctionBlock)]
pub struct Lowpass {
    /// raw signal
    #[input]                u: f64,
    /// filtered signal
    #[output]               y: f64,
    /// smoothing factor, 0 to 1
    #[param(default = 0.1)] alpha: f64,
}
impl Step for Lowpass {
    fn step(&mut self, _: &Invocation) -> Outcome { self.y += self.alpha * (self.u - self.y); Outcome::Done }
}
