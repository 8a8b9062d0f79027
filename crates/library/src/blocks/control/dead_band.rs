// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The band is negative.
const NEGATIVE_BAND: u32 = 1;

/// Dead band: y = 0 if |u - middle| <= width, otherwise u - middle moved towards 0 by width.
///
/// The output does not jump at the edges. It is used for joysticks, and to ignore errors that are too small to act on. Range: width from
/// 0. Faults: 1 the width is negative or NaN.
#[derive(FunctionBlock)]
pub struct DeadBand {
    /// input
    #[input]
    u: f64,
    /// part of the input outside the band
    #[output(unit = "=u")]
    y: f64,
    /// half-width of the band
    #[param(default = 0.1, range = "[0, inf)")]
    width: f64,
    /// centre of the band
    #[param(default = 0.0, range = "[-inf, inf)")]
    middle: f64,
}

impl Step for DeadBand {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.width.is_nan() || self.width < 0.0 {
            return Outcome::Fault(NEGATIVE_BAND);
        }
        let off = self.u - self.middle;
        self.y = match off {
            _ if off > self.width => off - self.width,
            _ if off < -self.width => off + self.width,
            _ if off.is_nan() => off,
            _ => 0.0,
        };
        Outcome::Done
    }
}
