// SPDX-License-Identifier: Apache-2.0
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// The range is empty: low is above high.
const EMPTY_RANGE: u32 = 1;
/// The value is not a finite number.
const NOT_FINITE: u32 = 2;

/// Awaits a value in a range: reports `done` if low <= u <= high.
///
/// Faults: 1 the range is empty, low is above high; 2 the monitored value is not finite
#[derive(FunctionBlock)]
pub struct AwaitRange {
    /// monitored value
    #[input]
    u: f64,
    /// latest value
    #[output]
    latest: f64,
    /// minimum value
    #[param(default = -1e300, range = "[-inf, inf)")]
    low: f64,
    /// maximum value
    #[param(default = 1e300, range = "[-inf, inf)")]
    high: f64,
    /// the input is in the range; the value is the input
    #[condition(preset = 0.0)]
    done: ConditionOf<f64>,
}

impl Step for AwaitRange {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.low > self.high {
            return Outcome::Fault(EMPTY_RANGE);
        }
        if !self.u.is_finite() {
            return Outcome::Fault(NOT_FINITE);
        }
        self.latest = self.u;
        if (self.low..=self.high).contains(&self.u) {
            self.done.report(self.u);
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn awaits(u: f64, low: f64, high: f64) -> (Outcome, bool) {
        let mut block = AwaitRange { u, latest: 0.0, low, high, done: ConditionOf::new(0.0) };
        let outcome = block.step(&Invocation::default());
        (outcome, block.done.is_reported())
    }

    #[test]
    fn reports_within_the_range() {
        assert_eq!(awaits(1.0, 1.0, 2.0), (Outcome::Done, true));
        assert_eq!(awaits(0.9, 1.0, 2.0), (Outcome::Done, false));
        assert_eq!(awaits(2.1, 1.0, 2.0), (Outcome::Done, false));
        assert_eq!(awaits(1.0, 2.0, 1.0).0, Outcome::Fault(EMPTY_RANGE));
        assert_eq!(awaits(f64::NAN, 1.0, 2.0).0, Outcome::Fault(NOT_FINITE));
    }
}
