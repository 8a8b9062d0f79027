// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// A variance is out of range.
const BAD_VARIANCE: u32 = 1;

/// One-dimensional Kalman filter for a drifting value: p += drift dt, k = p / (p + noise), y += k (u - y), p = (1 - k) p.
///
/// The best linear estimate of a random walk measured with noise; starts at the first measurement. The gain converges to that of a
/// low-pass filter; until then, the filter is faster. Source: Kalman, 1960; Brown and Hwang, Introduction to Random Signals and Applied
/// Kalman Filtering, 4. Range: noise above 0, drift from 0. Faults: 1 the variance of the noise is not above 0, or that of the drift is
/// negative.
#[derive(FunctionBlock)]
pub struct Kalman {
    /// measurement
    #[input]
    u: f64,
    /// estimate
    #[output]
    y: f64,
    /// variance p of the estimate
    #[output]
    variance: f64,
    /// gain k of this invocation
    #[output]
    gain: f64,
    /// variance of a measurement
    #[param(default = 1.0, range = "(0, inf)")]
    noise: f64,
    /// variance of the drift of the value per second
    #[param(default = 1.0, range = "[0, inf)")]
    drift: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
}

impl Step for Kalman {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if !(self.noise > 0.0 && self.drift >= 0.0) {
            return Outcome::Fault(BAD_VARIANCE);
        }
        let first = !self.span.begun();
        let span_s = self.span.elapsed(invocation);
        if first {
            (self.y, self.variance, self.gain) = (self.u, self.noise, 1.0);
        } else {
            let ahead = self.variance + self.drift * span_s;
            self.gain = ahead / (ahead + self.noise);
            self.y += self.gain * (self.u - self.y);
            self.variance = (1.0 - self.gain) * ahead;
        }
        Outcome::Done
    }
}
