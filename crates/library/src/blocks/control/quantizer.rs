// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The step is not above 0.
const BAD_STEP: u32 = 1;

/// Quantizer: y = offset + step round((u - offset) / step), halves away from 0.
///
/// Models a converter with this resolution. Range: step above 0. Faults: 1 the step is not above 0.
#[derive(FunctionBlock)]
pub struct Quantizer {
    /// input
    #[input]
    u: f64,
    /// nearest quantized value
    #[output(unit = "=u")]
    y: f64,
    /// distance between adjacent values
    #[param(default = 0.1, range = "(0, inf)")]
    step: f64,
    /// any one of the quantized values
    #[param(default = 0.0, range = "[-inf, inf)")]
    offset: f64,
}

impl Step for Quantizer {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.step.is_nan() || self.step <= 0.0 {
            return Outcome::Fault(BAD_STEP);
        }
        self.y = self.offset + self.step * ((self.u - self.offset) / self.step).round();
        Outcome::Done
    }
}
