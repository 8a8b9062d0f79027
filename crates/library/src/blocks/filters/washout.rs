// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The time constant is not above 0.
const BAD_TIME: u32 = 1;

/// Washout, a first-order high-pass filter: Y(s) = T s / (1 + T s) U(s).
///
/// Passes changes and removes the constant part, such as the offset of a force sensor. Discretised by the bilinear transform for the
/// interval of its invocations; the output starts at 0. Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems, 6.1.
/// Range: T above 0. Faults: 1 the time constant is not above 0.
#[derive(FunctionBlock)]
pub struct Washout {
    /// raw signal
    #[input]
    u: f64,
    /// changing part of the input
    #[output(unit = "=u")]
    y: f64,
    /// time constant T
    #[param(default = 1.0, unit = "s", range = "(0, inf)")]
    time: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
    /// input in the previous invocation
    #[state]
    before: f64,
}

impl Step for Washout {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.time.is_nan() || self.time <= 0.0 {
            return Outcome::Fault(BAD_TIME);
        }
        let first = !self.span.begun();
        let span_s = self.span.used(invocation);
        if first {
            // A first sample that is not finite shows at once in the output, not only at the next invocation.
            self.y = if self.u.is_finite() { 0.0 } else { self.u };
        } else {
            let twice = 2.0 * self.time;
            self.y = (twice * (self.u - self.before) + (twice - span_s) * self.y) / (twice + span_s);
        }
        self.before = self.u;
        Outcome::Done
    }
}
