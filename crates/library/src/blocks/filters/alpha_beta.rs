// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The gains do not make the observer stable.
const BAD_GAINS: u32 = 1;

/// Alpha-beta tracking observer: x = x^ + alpha r, v += beta r / dt with x^ = x + v dt and r = u - x^.
///
/// Estimates position and velocity from a measured position alone, without the lag of a filtered difference; starts at the first
/// position, at rest. beta = alpha^2 / (2 - alpha) is the choice of Benedict and Bordner, 1962. Range: alpha 0 to 1, beta 0 to 4 - 2
/// alpha (stability). Faults: 1 alpha is not 0 to 1, or beta not 0 to 4 - 2 alpha.
#[derive(FunctionBlock)]
pub struct AlphaBeta {
    /// measured position
    #[input]
    u: f64,
    /// estimated position x
    #[output]
    position: f64,
    /// estimated velocity v, per second
    #[output]
    velocity: f64,
    /// innovation r
    #[output]
    residual: f64,
    /// gain of the position
    #[param(default = 0.5, range = "[0, 1]")]
    alpha: f64,
    /// gain of the velocity
    #[param(default = 0.1667, range = "[0, 4]")]
    beta: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
}

impl Step for AlphaBeta {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let stable = (0.0..=1.0).contains(&self.alpha) && self.beta >= 0.0 && self.beta <= 4.0 - 2.0 * self.alpha;
        if !stable {
            return Outcome::Fault(BAD_GAINS);
        }
        let first = !self.span.begun();
        let span_s = self.span.elapsed(invocation);
        if first {
            (self.position, self.velocity, self.residual) = (self.u, 0.0, 0.0);
        } else if span_s > 0.0 {
            let ahead = self.position + self.velocity * span_s;
            self.residual = self.u - ahead;
            self.position = ahead + self.alpha * self.residual;
            self.velocity += self.beta * self.residual / span_s;
        }
        Outcome::Done
    }
}
