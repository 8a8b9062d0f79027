// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The time constant is negative.
const NEGATIVE_TIME: u32 = 1;

/// Filtered differentiator: Y(s) = s / (1 + T s) U(s), by backward differences.
///
/// T = 0 gives the plain difference, which amplifies noise the most. The output starts at 0. Unlike a differentiator that is discretised
/// by the bilinear transform, it never rings. Source: Astrom and Hagglund, Advanced PID Control, 13.4. Range: T from 0. Faults: 1 the
/// time constant is negative or NaN.
#[derive(FunctionBlock)]
pub struct Differentiator {
    /// input
    #[input]
    u: f64,
    /// rate of change of the input, per second
    #[output]
    y: f64,
    /// time constant T of the filter
    #[param(default = 0.01, unit = "s", range = "[0, inf)")]
    time: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
    /// input in the previous invocation
    #[state]
    before: f64,
}

impl Step for Differentiator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.time.is_nan() || self.time < 0.0 {
            return Outcome::Fault(NEGATIVE_TIME);
        }
        let first = !self.span.begun();
        let span_s = self.span.elapsed(invocation);
        if first {
            // A first sample that is not finite shows at once in the output, not only at the next invocation.
            self.y = if self.u.is_finite() { 0.0 } else { self.u };
            self.before = self.u;
        } else if span_s > 0.0 {
            self.y = (self.time * self.y + (self.u - self.before)) / (self.time + span_s);
            self.before = self.u;
        }
        Outcome::Done
    }
}
