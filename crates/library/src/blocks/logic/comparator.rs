// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// The hysteresis is negative.
const NEGATIVE_HYSTERESIS: u32 = 1;
/// An input is not finite.
const NOT_FINITE: u32 = 2;

/// Comparator: above = true at u > reference + hysteresis, false at u < reference - hysteresis, and unchanged between them.
///
/// The hysteresis suppresses chatter caused by noise; the output starts false. Reports each crossing. Range: hysteresis from 0. Faults: 1
/// the hysteresis is negative or NaN; 2 an input is not finite.
#[derive(FunctionBlock)]
pub struct Comparator {
    /// input
    #[input]
    u: f64,
    /// value to compare with
    #[input(asynchronous, default = 0.0, range = "[-inf, inf)")]
    reference: f64,
    /// true if the input is above the reference
    #[output]
    above: bool,
    /// half-width of the band in which the output does not change
    #[param(default = 0.0, range = "[0, inf)")]
    hysteresis: f64,
    /// the input has risen above the band
    #[condition]
    rose: Condition,
    /// the input has fallen below the band
    #[condition]
    fell: Condition,
}

impl Step for Comparator {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.hysteresis.is_nan() || self.hysteresis < 0.0 {
            return Outcome::Fault(NEGATIVE_HYSTERESIS);
        }
        if !(self.u.is_finite() && self.reference.is_finite()) {
            return Outcome::Fault(NOT_FINITE);
        }
        let off = self.u - self.reference;
        if !self.above && off > self.hysteresis {
            self.above = true;
            self.rose.report();
        } else if self.above && off < -self.hysteresis {
            self.above = false;
            self.fell.report();
        }
        Outcome::Done
    }
}
