// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// A rate is negative.
const NEGATIVE_RATE: u32 = 1;

/// Rate limiter: y' = u' within -falling <= y' <= rising; else y follows u at that rate until it is there.
///
/// It begins at its first input. A sawtooth through it becomes a triangle, a step a ramp. Range: both rates from 0, per second.
/// Faults: 1 a rate is negative or no number.
#[derive(FunctionBlock)]
pub struct RateLimiter {
    /// input
    #[input]
    u: f64,
    /// limited input
    #[output(unit = "=u")]
    y: f64,
    /// maximum rise in a second
    #[param(default = 1.0, range = "[0, inf)")]
    rising: f64,
    /// maximum fall in a second
    #[param(default = 1.0, range = "[0, inf)")]
    falling: f64,
    /// the output does not follow
    #[condition]
    limited: Condition,
    /// time of the invocation before
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
            // The last step may round to the input: then it is there.
            if self.y != self.u {
                self.limited.report();
            }
        }
        Outcome::Done
    }
}
