// SPDX-License-Identifier: Apache-2.0
//! Polling in waits: if an answer will probably arrive within microseconds, polling is faster than waking a thread. A wait polls for a
//! bounded time, and its result never depends on polling, because the supervisor's thread is woken in any case.

/// Time for which a wait polls, ns; equal to the duration of a few thread wake-ups.
const AWAKE_NS: i64 = 60_000;

/// Time before a release at which polling starts, ns; equal to the latency of a timer wake-up.
const LEAD_NS: i64 = 100_000;

/// Number of releases for which a wait polls.
const RELEASES_MAX: i64 = 2;

/// Event that a wait expects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Watchful {
    /// Immediate answer.
    At,
    /// Answer at one of the next releases of a timer with this period, ns.
    AtRelease(i64),
}

impl Watchful {
    /// Returns the time until which a wait that began at `begun_ns` polls; `None` if it is asleep at `now_ns`.
    pub fn looks_until_ns(self, begun_ns: i64, now_ns: i64) -> Option<i64> {
        let end_ns = match self {
            Watchful::At => begun_ns + AWAKE_NS,
            Watchful::AtRelease(period_ns) => {
                let release_ns = (now_ns - AWAKE_NS).div_euclid(period_ns) * period_ns + period_ns;
                let is_near = release_ns - LEAD_NS <= now_ns;
                if !is_near || release_ns > begun_ns + RELEASES_MAX * period_ns {
                    return None;
                }
                release_ns + AWAKE_NS
            }
        };
        (now_ns < end_ns).then_some(end_ns)
    }

    /// Returns the time at which a wait that is asleep at `now_ns` polls again; `None` if it will not poll again.
    pub fn looks_next_ns(self, begun_ns: i64, now_ns: i64) -> Option<i64> {
        let Watchful::AtRelease(period_ns) = self else { return None };
        let release_ns = now_ns.div_euclid(period_ns) * period_ns + period_ns;
        (release_ns <= begun_ns + RELEASES_MAX * period_ns).then_some(release_ns - LEAD_NS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: i64 = 1_000_000;
    const AT_RELEASE: Watchful = Watchful::AtRelease(PERIOD_NS);

    #[test]
    fn an_answer_that_comes_at_once_is_looked_for_at_once_and_not_for_long() {
        assert_eq!(Watchful::At.looks_until_ns(500, 500), Some(500 + AWAKE_NS));
        assert_eq!(Watchful::At.looks_until_ns(500, 500 + AWAKE_NS), None);
        assert_eq!(Watchful::At.looks_next_ns(500, 500 + AWAKE_NS), None);
    }

    #[test]
    fn an_answer_at_a_release_is_looked_for_around_it() {
        let begun_ns = 7 * PERIOD_NS + 300_000;
        assert_eq!(AT_RELEASE.looks_until_ns(begun_ns, begun_ns), None, "nothing can have come yet");
        let next_ns = AT_RELEASE.looks_next_ns(begun_ns, begun_ns).expect("a release comes");
        assert_eq!(next_ns, 8 * PERIOD_NS - LEAD_NS);
        assert_eq!(AT_RELEASE.looks_until_ns(begun_ns, next_ns), Some(8 * PERIOD_NS + AWAKE_NS));
        let after_ns = 8 * PERIOD_NS + AWAKE_NS;
        assert_eq!(AT_RELEASE.looks_until_ns(begun_ns, after_ns - 1), Some(after_ns));
        assert_eq!(AT_RELEASE.looks_until_ns(begun_ns, after_ns), None);
        assert_eq!(AT_RELEASE.looks_next_ns(begun_ns, after_ns), Some(9 * PERIOD_NS - LEAD_NS));
    }

    #[test]
    fn a_wait_that_lasts_sleeps() {
        let begun_ns = 7 * PERIOD_NS + 300_000;
        let late_ns = 9 * PERIOD_NS + AWAKE_NS;
        assert_eq!(AT_RELEASE.looks_next_ns(begun_ns, late_ns), None);
        for now_ns in (late_ns..20 * PERIOD_NS).step_by(10_000) {
            assert_eq!(AT_RELEASE.looks_until_ns(begun_ns, now_ns), None, "{now_ns}");
        }
    }

    #[test]
    fn a_timer_that_is_faster_than_a_thread_wakes_is_looked_at_without_a_break() {
        let fast = Watchful::AtRelease(50_000);
        for now_ns in (0..100_000).step_by(1_000) {
            assert!(fast.looks_until_ns(0, now_ns).is_some(), "{now_ns}");
        }
        assert_eq!(fast.looks_until_ns(0, 200_000), None);
    }
}
