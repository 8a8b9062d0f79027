// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The upper level is below the lower level.
const EMPTY_RANGE: u32 = 1;
/// The input is not finite.
const NOT_FINITE: u32 = 2;

/// Hysteresis, a relay: active becomes true at u >= upper, false at u <= lower; y = high or low.
///
/// Between the levels, the state is retained; the relay starts inactive. It is used for on-off control, as in a thermostat. Range: upper
/// not below lower; if they are equal, the relay is active for u at that level. Faults: 1 upper is below lower; 2 the input is not
/// finite.
#[derive(FunctionBlock)]
pub struct Hysteresis {
    /// input
    #[input]
    u: f64,
    /// high if active, otherwise low
    #[output]
    y: f64,
    /// true if active
    #[output]
    active: bool,
    /// level at or above which the output becomes active
    #[param(default = 0.5, range = "[-inf, inf)")]
    upper: f64,
    /// level at or below which the output becomes inactive
    #[param(default = -0.5, range = "[-inf, inf)")]
    lower: f64,
    /// output if active
    #[param(default = 1.0, range = "[-inf, inf)")]
    high: f64,
    /// output if inactive
    #[param(default = 0.0, range = "[-inf, inf)")]
    low: f64,
}

impl Step for Hysteresis {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.upper.is_nan() || self.lower.is_nan() || self.upper < self.lower {
            return Outcome::Fault(EMPTY_RANGE);
        }
        if !self.u.is_finite() {
            return Outcome::Fault(NOT_FINITE);
        }
        self.active = self.u >= self.upper || (self.active && self.u > self.lower);
        self.y = if self.active { self.high } else { self.low };
        Outcome::Done
    }
}
