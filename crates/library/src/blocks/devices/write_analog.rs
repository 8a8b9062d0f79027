// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The value to write is not a finite number.
const NOT_FINITE: u32 = 1;
/// The range is empty: low is above high.
const EMPTY_RANGE: u32 = 2;

/// Writes an analog device channel within its range: y = min(max(u, low), high), channel = y.
///
/// Faults: 1 the value is not finite; 2 the range is empty, low is above high.
#[derive(FunctionBlock)]
pub struct WriteAnalog {
    /// value to write at the end of the firing
    #[input(asynchronous)]
    u: f64,
    /// written value
    #[output]
    y: f64,
    /// minimum value
    #[param(default = -1e300, range = "[-inf, inf)")]
    low: f64,
    /// maximum value
    #[param(default = 1e300, range = "[-inf, inf)")]
    high: f64,
    /// channel of a physical device
    #[device(write)]
    channel: f64,
}

impl Step for WriteAnalog {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if !self.u.is_finite() {
            return Outcome::Fault(NOT_FINITE);
        }
        if self.low > self.high {
            return Outcome::Fault(EMPTY_RANGE);
        }
        self.y = self.u.clamp(self.low, self.high);
        self.channel = self.y;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_finite_numbers_within_the_range() {
        let mut block = WriteAnalog { u: 1.5, y: 0.0, low: 0.0, high: 1.0, channel: 0.0 };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert_eq!((block.channel, block.y), (1.0, 1.0));
        block.u = f64::NAN;
        assert_eq!(block.step(&Invocation::default()), Outcome::Fault(NOT_FINITE));
        (block.u, block.low) = (0.5, 2.0);
        assert_eq!(block.step(&Invocation::default()), Outcome::Fault(EMPTY_RANGE));
        assert_eq!(block.channel, 1.0);
    }
}
