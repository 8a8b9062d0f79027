// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The upper level is below the lower.
const EMPTY_RANGE: u32 = 1;
/// The input is not finite.
const NOT_FINITE: u32 = 2;

/// Hysteresis, a relay: active = true from u >= upper on, false from u <= lower on; y = high or low.
///
/// Between the levels it stays as it is; it begins inactive. Two-point control, a thermostat. Range: upper not below lower; where they are
/// equal, u at that level is active.
/// Faults: 1 upper is below lower; 2 the input is not finite.
#[derive(FunctionBlock)]
pub struct Hysteresis {
    /// input
    #[input]
    u: f64,
    /// high where it is active, else low
    #[output]
    y: f64,
    /// true if it is active
    #[output]
    active: bool,
    /// level from which on it is active
    #[param(default = 0.5, range = "[-inf, inf)")]
    upper: f64,
    /// level from which on, downwards, it is not
    #[param(default = -0.5, range = "[-inf, inf)")]
    lower: f64,
    /// output where it is active
    #[param(default = 1.0, range = "[-inf, inf)")]
    high: f64,
    /// output where it is not
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
