// SPDX-License-Identifier: Apache-2.0
//! Restart intensity, as in supervision trees: how often a process may be restarted.
use std::collections::VecDeque;
use std::time::Duration;

/// Limit of `most` restarts within any span of `within`. It has no clock: the caller passes the time.
///
/// ```
/// use process_kit::Restarts;
/// use std::time::Duration;
///
/// let mut restarts = Restarts::new(2, Duration::from_secs(10));
/// assert!(restarts.allow(0) && restarts.allow(1_000_000_000));
/// assert!(!restarts.allow(2_000_000_000), "the third within 10 s");
/// assert!(restarts.allow(10_000_000_000), "the first is 10 s ago");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Restarts {
    most: u32,
    within: Duration,
    /// Times of the restarts within the window, ns, oldest first; at most `most` entries.
    recent: VecDeque<i64>,
}

impl Restarts {
    /// Creates a limit. If `most` is 0, no restart is allowed.
    pub fn new(most: u32, within: Duration) -> Restarts {
        Restarts { most, within, recent: VecDeque::new() }
    }

    /// Counts a restart at `now_ns` if the limit allows it; returns true if it does. Times must not run backwards: an earlier time is
    /// treated as the latest one so far.
    pub fn allow(&mut self, now_ns: i64) -> bool {
        let now_ns = self.recent.back().map_or(now_ns, |latest| now_ns.max(*latest));
        let within_ns = i64::try_from(self.within.as_nanos()).unwrap_or(i64::MAX);
        while self.recent.front().is_some_and(|restart_ns| now_ns.saturating_sub(*restart_ns) >= within_ns) {
            self.recent.pop_front();
        }
        let allowed = self.recent.len() < self.most as usize;
        if allowed {
            self.recent.push_back(now_ns);
        }
        allowed
    }

    /// Returns the number of restarts currently counted.
    pub fn counted(&self) -> usize {
        self.recent.len()
    }

    /// Forgets all restarts, after a person has reset the limit.
    pub fn forget(&mut self) {
        self.recent.clear();
    }
}

impl std::fmt::Display for Restarts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "at most {} restarts within {:?}", self.most, self.within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_span_has_more_than_the_limit_and_none_is_refused_without_cause(
            most in 0u32..5, within_ns in 1u64..50, steps in prop::collection::vec(0i64..20, 0..60),
        ) {
            let mut restarts = Restarts::new(most, Duration::from_nanos(within_ns));
            let (mut now_ns, mut allowed) = (0, Vec::new());
            for step in steps {
                now_ns += step;
                let recent = allowed.iter().filter(|at| now_ns - **at < within_ns as i64).count();
                prop_assert_eq!(restarts.allow(now_ns), recent < most as usize);
                if recent < most as usize {
                    allowed.push(now_ns);
                }
                prop_assert!(restarts.counted() <= most as usize);
            }
        }
    }

    #[test]
    fn a_clock_that_goes_back_gives_no_restart_more() {
        let mut restarts = Restarts::new(1, Duration::from_nanos(10));
        assert!(restarts.allow(100));
        assert!(!restarts.allow(0) && !restarts.allow(109));
        assert!(restarts.allow(110));
        restarts.forget();
        assert!(restarts.allow(110));
    }
}
