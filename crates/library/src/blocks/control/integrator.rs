// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The range is empty.
const EMPTY_RANGE: u32 = 1;

/// Integrator: y = initial + gain ∫u dt, by the trapezoidal rule, clamped to low and high.
///
/// `reset` sets the output to `initial` and keeps it there as long as `reset` is true. There is no wind-up at a limit: the output leaves
/// the limit as soon as u changes sign. Source: Astrom and Hagglund, Advanced PID Control, 3.5. Range: low not above high. Faults: 1 low
/// is above high.
#[derive(FunctionBlock)]
pub struct Integrator {
    /// input
    #[input]
    u: f64,
    /// true: reset the output to the initial value
    #[input(asynchronous, default = false)]
    reset: bool,
    /// value at the start and after a reset
    #[input(asynchronous, default = 0.0, range = "[-inf, inf)")]
    initial: f64,
    /// integral
    #[output]
    y: f64,
    /// gain
    #[param(default = 1.0, range = "[-inf, inf)")]
    gain: f64,
    /// minimum output
    #[param(default = f64::NEG_INFINITY, range = "[-inf, inf)")]
    low: f64,
    /// maximum output
    #[param(default = f64::INFINITY, range = "[-inf, inf)")]
    high: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
    /// input in the previous invocation
    #[state]
    before: f64,
}

impl Step for Integrator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.low.is_nan() || self.high.is_nan() || self.low > self.high {
            return Outcome::Fault(EMPTY_RANGE);
        }
        let first = !self.span.begun();
        let span_s = self.span.used(invocation);
        // A sample that is not finite shows at once in the output, even during a reset: it must not wait in `before`.
        let wanted = if !self.u.is_finite() {
            self.u
        } else if first || self.reset {
            self.initial
        } else {
            self.y + self.gain * 0.5 * (self.u + self.before) * span_s
        };
        self.y = if !wanted.is_finite() { wanted } else { wanted.clamp(self.low, self.high) };
        self.before = self.u;
        Outcome::Done
    }
}
