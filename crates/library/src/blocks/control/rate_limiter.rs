// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// A rate is negative.
const NEGATIVE_RATE: u32 = 1;

/// Rate limiter: y' = u' if -falling <= u' <= rising; otherwise y follows u at the limiting rate until it has caught up.
///
/// The output starts at the first input. A step, for example, becomes a ramp. Range: both rates from 0, per second. Faults: 1 a rate is
/// negative or NaN.
#[derive(FunctionBlock)]
pub struct RateLimiter {
    /// input
    #[input]
    u: f64,
    /// limited input
    #[output(unit = "=u")]
    y: f64,
    /// maximum rise per second
    #[param(default = 1.0, range = "[0, inf)")]
    rising: f64,
    /// maximum fall per second
    #[param(default = 1.0, range = "[0, inf)")]
    falling: f64,
    /// the output lags behind the input
    #[condition]
    limited: Condition,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
}

impl Step for RateLimiter {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if !(self.rising >= 0.0 && self.falling >= 0.0) {
            return Outcome::Fault(NEGATIVE_RATE);
        }
        let first = !self.span.begun();
        let span_s = self.span.used(invocation);
        let (wanted, rise, fall) = (self.u - self.y, self.rising * span_s, self.falling * span_s);
        if first || !(wanted > rise || wanted < -fall) {
            self.y = self.u;
        } else {
            self.y += if wanted > 0.0 { rise } else { -fall };
            // The last step may round to the input: then the output has caught up.
            if self.y != self.u {
                self.limited.report();
            }
        }
        Outcome::Done
    }
}
