// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// Number of beat values per client, after which they repeat.
const BEATS: i64 = 1 << 20;

/// Heartbeat: lost = (time since `beat` changed) > limit, reported as `late` from the first invocation in which it is true.
///
/// The client that holds the button periodically writes a new number to `beat`. If several clients write to the same `beat`, each has its
/// own number, `client`, and writes numbers from client · 2^20 to client · 2^20 + 2^20 − 1, so that numbers from other clients are
/// ignored. The heartbeat counts as alive at the start, and again after the next change. Time is clock time, which also elapses while the
/// verb is suspended.
#[derive(FunctionBlock)]
pub struct Heartbeat {
    /// number that changes with each beat
    #[input(asynchronous)]
    beat: i64,
    /// true if the last change is too old
    #[output]
    lost: bool,
    /// age of the last change
    #[output(unit = "s")]
    age: f64,
    /// maximum age
    #[param(default = 0.25, unit = "s", range = "(0, inf)")]
    limit: f64,
    /// number of the client that holds the button; 0: a change from any client counts
    #[param(default = 0, range = "[0, 2147483647]")]
    client: i64,
    /// the last change is too old
    #[condition]
    late: Condition,
    /// number at the last change
    #[state]
    before: i64,
    /// time of the last change, ns; -1: not started
    #[state(initial = -1)]
    changed_ns: i64,
}

impl Step for Heartbeat {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let counts = self.client == 0 || self.beat.div_euclid(BEATS) == self.client;
        if self.changed_ns < 0 || (counts && self.beat != self.before) {
            (self.before, self.changed_ns) = (self.beat, invocation.now_ns);
        }
        self.age = (invocation.now_ns - self.changed_ns) as f64 * 1e-9;
        let was_lost = self.lost;
        self.lost = self.age > self.limit;
        if self.lost && !was_lost {
            self.late.report();
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_lost_when_it_is_too_old_and_comes_back() {
        let mut heart = Heartbeat { beat: 7, lost: false, age: 0.0, limit: 0.1, client: 0, late: Condition::new(), before: 0, changed_ns: -1 };
        let mut lost = Vec::new();
        for k in 0..30i64 {
            heart.beat = if k >= 20 { 8 } else { 7 };
            heart.late = Condition::new();
            assert_eq!(heart.step(&Invocation { number: k as u64, time_ns: 0, now_ns: 5_000_000 + k * 20_000_000 }), Outcome::Done);
            assert_eq!(heart.late.is_reported(), k == 6 || k == 26, "at {k}");
            if heart.lost {
                lost.push(k);
            }
        }
        assert_eq!(lost, (6..20).chain(26..30).collect::<Vec<_>>());
    }

    #[test]
    fn beats_of_another_client_do_not_count() {
        let mut heart = Heartbeat { beat: 3 * BEATS, lost: false, age: 0.0, limit: 0.1, client: 3, late: Condition::new(), before: 0, changed_ns: -1 };
        let mut late = None;
        for k in 0..30i64 {
            // Both clients beat until the tenth invocation, in turn; then only the other one does.
            heart.beat = if k < 10 && k % 2 == 0 { 3 * BEATS + k } else { 4 * BEATS + k };
            heart.late = Condition::new();
            assert_eq!(heart.step(&Invocation { number: k as u64, time_ns: 0, now_ns: k * 20_000_000 }), Outcome::Done);
            late = late.or(heart.late.is_reported().then_some(k));
        }
        assert_eq!(late, Some(14), "the last own beat was at 8");
    }
}
