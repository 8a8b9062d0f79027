// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The divisor is too close to 0.
const BY_ZERO: u32 = 1;

/// Division: y = u / v.
///
/// Range: |v| above `least`. Faults: 1 the magnitude of the divisor is not above `least`, or the divisor is NaN.
#[derive(FunctionBlock)]
pub struct Divide {
    /// dividend
    #[input]
    u: f64,
    /// divisor
    #[input]
    v: f64,
    /// quotient
    #[output]
    y: f64,
    /// a divisor of this magnitude or less is a fault
    #[param(default = 0.0, range = "[0, inf)")]
    least: f64,
}

impl Step for Divide {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.v.is_nan() || self.v.abs() <= self.least {
            return Outcome::Fault(BY_ZERO);
        }
        self.y = self.u / self.v;
        Outcome::Done
    }
}
