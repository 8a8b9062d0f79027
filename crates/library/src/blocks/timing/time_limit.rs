// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// Time limit: remaining = limit - (time since the first invocation), reported as `expired` when it reaches 0; suspended time does not
/// count.
#[derive(FunctionBlock)]
pub struct TimeLimit {
    /// remaining time, never below 0
    #[output(unit = "s")]
    remaining: f64,
    /// time limit
    #[param(default = 1.0, unit = "s", range = "(0, inf)")]
    limit: f64,
    /// the time limit has expired
    #[condition]
    expired: Condition,
    /// running time at the first invocation, ns
    #[state(initial = -1)]
    begun_ns: i64,
}

impl Step for TimeLimit {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.begun_ns < 0 {
            self.begun_ns = invocation.time_ns;
        }
        let passed_s = (invocation.time_ns - self.begun_ns) as f64 * 1e-9;
        self.remaining = (self.limit - passed_s).max(0.0);
        if passed_s >= self.limit {
            self.expired.report();
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expires_at_the_limit_and_not_before() {
        let mut block = TimeLimit { remaining: 0.0, limit: 0.05, expired: Condition::new(), begun_ns: -1 };
        for k in 0..5 {
            assert_eq!(block.step(&Invocation { number: k, time_ns: 7_000_000 + k as i64 * 10_000_000, now_ns: 0 }), Outcome::Done);
            assert!(!block.expired.is_reported());
        }
        assert!((block.remaining - 0.01).abs() < 1e-12);
        assert_eq!(block.step(&Invocation { number: 5, time_ns: 57_000_000, now_ns: 0 }), Outcome::Done);
        assert!(block.expired.is_reported());
        assert_eq!(block.remaining, 0.0);
    }
}
