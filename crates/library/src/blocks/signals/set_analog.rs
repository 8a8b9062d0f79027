// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The value is out of range.
const OUT_OF_RANGE: u32 = 1;

/// Sets an analog value: y = value, refused if it is outside the range low to high.
///
/// Faults: 1 the value is out of the range of the output
#[derive(FunctionBlock)]
pub struct SetAnalog {
    /// value that is set
    #[output]
    y: f64,
    /// value to set
    #[param(default = 0.0, range = "[-inf, inf)")]
    value: f64,
    /// minimum value
    #[param(default = -1e300, range = "[-inf, inf)")]
    low: f64,
    /// maximum value
    #[param(default = 1e300, range = "[-inf, inf)")]
    high: f64,
}

impl Step for SetAnalog {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if !(self.low..=self.high).contains(&self.value) {
            return Outcome::Fault(OUT_OF_RANGE);
        }
        self.y = self.value;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_within_the_range() {
        let mut block = SetAnalog { y: 0.0, value: 4.0, low: 0.0, high: 10.0 };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert_eq!(block.y, 4.0);
        block.value = 10.5;
        assert_eq!(block.step(&Invocation::default()), Outcome::Fault(OUT_OF_RANGE));
        assert_eq!(block.y, 4.0);
    }
}
