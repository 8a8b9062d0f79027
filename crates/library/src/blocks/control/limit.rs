// SPDX-License-Identifier: Apache-2.0
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// The range is empty: low is above high.
const EMPTY_RANGE: u32 = 1;

/// Limit: y = min(max(u, low), high); fault 1 if low is above high.
#[derive(FunctionBlock)]
pub struct Limit {
    /// input
    #[input]
    u: f64,
    /// limited input
    #[output(unit = "=u")]
    y: f64,
    /// minimum output
    #[param(default = -1.0, unit = "=u", range = "[-inf, inf)")]
    low: f64,
    /// maximum output
    #[param(default = 1.0, unit = "=u", range = "[-inf, inf)")]
    high: f64,
    /// the input was out of range; the value is the excess
    #[condition(preset = 0.0)]
    limited: ConditionOf<f64>,
}

impl Step for Limit {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.low > self.high {
            return Outcome::Fault(EMPTY_RANGE);
        }
        // Not `clamp` alone: a NaN must propagate so that it is detected.
        self.y = if self.u.is_nan() { self.u } else { self.u.clamp(self.low, self.high) };
        if self.y != self.u {
            self.limited.report(self.u - self.y);
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limit(u: f64, low: f64, high: f64) -> (Outcome, f64, Option<f64>) {
        let mut block = Limit { u, y: 0.0, low, high, limited: ConditionOf::new(0.0) };
        let outcome = block.step(&Invocation::default());
        (outcome, block.y, block.limited.is_reported().then_some(block.limited.value))
    }

    #[test]
    fn cuts_at_both_ends_and_says_by_how_much() {
        assert_eq!(limit(0.5, -1.0, 1.0), (Outcome::Done, 0.5, None));
        assert_eq!(limit(3.0, -1.0, 1.0), (Outcome::Done, 1.0, Some(2.0)));
        assert_eq!(limit(-4.0, -1.0, 1.0), (Outcome::Done, -1.0, Some(-3.0)));
        assert_eq!(limit(0.0, 1.0, -1.0).0, Outcome::Fault(EMPTY_RANGE));
    }
}
