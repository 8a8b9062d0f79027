// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The range is empty.
const EMPTY_RANGE: u32 = 1;

/// Scale: y = to_low + (u - from_low) (to_high - to_low) / (from_high - from_low), a straight line through two points.
///
/// Converts the counts of an A/D converter to engineering units, or 4 to 20 mA to a pressure. The output is not limited: see `limit`.
/// Range: from_low and from_high differ. Faults: 1 from_low and from_high are equal.
#[derive(FunctionBlock)]
pub struct Scale {
    /// input
    #[input]
    u: f64,
    /// scaled input
    #[output]
    y: f64,
    /// input of the first point
    #[param(default = 0.0, range = "[-inf, inf)")]
    from_low: f64,
    /// input of the second point
    #[param(default = 1.0, range = "[-inf, inf)")]
    from_high: f64,
    /// output at the first point
    #[param(default = 0.0, range = "[-inf, inf)")]
    to_low: f64,
    /// output at the second point
    #[param(default = 1.0, range = "[-inf, inf)")]
    to_high: f64,
}

impl Step for Scale {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.from_low == self.from_high {
            return Outcome::Fault(EMPTY_RANGE);
        }
        self.y = self.to_low + (self.u - self.from_low) * ((self.to_high - self.to_low) / (self.from_high - self.from_low));
        Outcome::Done
    }
}
