// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The time constant is negative.
const NEGATIVE_TIME: u32 = 1;

/// First-order lag (PT1), a low-pass filter defined by its time constant: T y' + y = k u.
///
/// Exact for an input that is constant between two invocations, whatever the interval; the output starts at k u. `lowpass` is the same
/// filter, defined by its smoothing factor. Source: Astrom and Wittenmark, Computer-Controlled Systems, 2.3 (zero-order hold). Range: T
/// at least 0; with T = 0, the block is a gain. Faults: 1 the time constant is negative or NaN.
#[derive(FunctionBlock)]
pub struct FirstOrderLag {
    /// input
    #[input]
    u: f64,
    /// lagged output
    #[output(unit = "=k.u")]
    y: f64,
    /// gain
    #[param(default = 1.0, range = "[-inf, inf)")]
    k: f64,
    /// time constant T: time to reach 63 % of a step
    #[param(default = 0.1, unit = "s", range = "[0, inf)")]
    time: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
    /// input in the previous invocation
    #[state]
    before: f64,
}

impl Step for FirstOrderLag {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.time.is_nan() || self.time < 0.0 {
            return Outcome::Fault(NEGATIVE_TIME);
        }
        let first = !self.span.begun();
        let span_s = self.span.used(invocation);
        if !self.u.is_finite() {
            // The sample must not wait in `before` until the next invocation.
            self.y = self.u;
        } else if first || self.time == 0.0 {
            self.y = self.k * self.u;
        } else {
            // The input held since the previous invocation has acted until now.
            self.y += -(-span_s / self.time).exp_m1() * (self.k * self.before - self.y);
        }
        self.before = self.u;
        Outcome::Done
    }
}
