// SPDX-License-Identifier: Apache-2.0
//! Attendance of one side of a device: silence of the other side counts only while this side was running.

/// Number of usual intervals between two checks above which a source counts as late because it was itself stalled.
const INTERVALS: i64 = 4;
/// Minimum gap, ns. Shorter gaps are normal on a busy machine.
const GAP_NS_MIN: i64 = 100_000_000;

/// Times at which one side checked the other. A paused process tree is suspended as a whole: the process that resumes first finds that
/// all others have been silent for as long as it has itself, and must not count this as their silence.
#[derive(Clone, Copy, Debug)]
pub struct Attendance {
    looked_ns: Option<i64>,
    interval_ns: Option<i64>,
    back_ns: i64,
}

impl Default for Attendance {
    fn default() -> Attendance {
        Attendance { looked_ns: None, interval_ns: None, back_ns: i64::MIN }
    }
}

impl Attendance {
    /// Records a check. Returns the time since which this side has been running without a gap, `i64::MIN` if always; a silence that began
    /// earlier counts from that time. This side was stalled if its check is late by more than half of the maximum silence, by at least
    /// 100 ms, and by several of its own intervals.
    pub fn look(&mut self, now_ns: i64, silent_max_ns: i64) -> i64 {
        if let Some(looked_ns) = self.looked_ns {
            let passed_ns = now_ns.saturating_sub(looked_ns);
            let is_late = self.interval_ns.is_some_and(|interval_ns| passed_ns > INTERVALS.saturating_mul(interval_ns));
            if is_late && passed_ns > GAP_NS_MIN.max(silent_max_ns / 2) {
                self.back_ns = now_ns;
            } else if passed_ns > 0 {
                self.interval_ns = Some(passed_ns);
            }
        }
        self.looked_ns = Some(now_ns);
        self.back_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn a_side_that_looks_in_time_was_always_there() {
        let mut attendance = Attendance::default();
        assert!((0..2000).all(|ms| attendance.look(ms * MS, 500 * MS) == i64::MIN));
        let mut slow = Attendance::default();
        assert!((0..20).all(|s| slow.look(s * 1000 * MS, 500 * MS) == i64::MIN), "one whose interval is long is not late");
    }

    #[test]
    fn a_silence_counts_from_when_this_side_came_back() {
        let mut attendance = Attendance::default();
        (0..10).for_each(|ms| assert_eq!(attendance.look(ms * MS, 500 * MS), i64::MIN));
        assert_eq!(attendance.look(209 * MS, 500 * MS), i64::MIN, "less than half of the silence that may be");
        (210..220).for_each(|ms| assert_eq!(attendance.look(ms * MS, 500 * MS), i64::MIN));
        for late_ms in [20_000, 20_001, 20_002, 21_000] {
            let back_ms = if late_ms == 21_000 { 21_000 } else { 20_000 };
            assert_eq!(attendance.look(late_ms * MS, 500 * MS), back_ms * MS);
        }
    }
}
