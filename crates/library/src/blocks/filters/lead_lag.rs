// SPDX-License-Identifier: Apache-2.0
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// A time constant is negative, or that of the lag is 0.
const BAD_TIME: u32 = 1;

/// Lead-lag compensator: Y(s) = k (1 + lead s) / (1 + lag s) U(s).
///
/// Discretised by the bilinear transform for the interval of its invocations; starts at k u, at rest. lead above lag gives phase lead.
/// Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems, 6.1. Range: lead from 0, lag above 0. Faults: 1 lead is
/// negative, or lag is not above 0.
#[derive(FunctionBlock)]
pub struct LeadLag {
    /// input
    #[input]
    u: f64,
    /// compensated output
    #[output]
    y: f64,
    /// gain
    #[param(default = 1.0, range = "[-inf, inf)")]
    k: f64,
    /// time constant of the numerator
    #[param(default = 0.1, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// time constant of the denominator
    #[param(default = 0.01, unit = "s", range = "(0, inf)")]
    lag: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
    /// input in the previous invocation
    #[state]
    before: f64,
}

impl Step for LeadLag {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if !(self.lead >= 0.0 && self.lag > 0.0) {
            return Outcome::Fault(BAD_TIME);
        }
        let first = !self.span.begun();
        let span_s = self.span.used(invocation);
        if first {
            self.y = self.k * self.u;
        } else {
            let now = (span_s + 2.0 * self.lead) * self.u + (span_s - 2.0 * self.lead) * self.before;
            self.y = (self.k * now - (span_s - 2.0 * self.lag) * self.y) / (span_s + 2.0 * self.lag);
        }
        self.before = self.u;
        Outcome::Done
    }
}
