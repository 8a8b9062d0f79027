// SPDX-License-Identifier: Apache-2.0
//! Time between two invocations, for blocks whose parameters are times and frequencies.
//!
//! A block that measures it needs no parameter that repeats the interval at which it is activated, and stays correct if the interval is
//! changed. Skipped releases leave gaps in the numbering, so the time lost is also known: motions, integrators and filters advance by one
//! cycle, as if that time had not elapsed. Thus no output jumps because a machine stalled.
use opengpac::Invocation;

/// The previous invocation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Span {
    before_ns: i64,
    number: u64,
    begun: bool,
}

/// Running time since the previous invocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ElapsedTime {
    /// Part of the time that belongs to one cycle.
    pub cycle_ns: i64,
    /// Rest of the time, which was lost with the skipped releases.
    pub lost_ns: i64,
}

/// Maximum loss, in cycles, that does not count as a gap, so that blocks on a source that is always slightly late still account for all
/// of the elapsed time.
const LATE: i64 = 2;

impl ElapsedTime {
    /// Returns true if so much time was lost that no block may act as if the time had been used.
    pub fn is_gap(self) -> bool {
        self.lost_ns > LATE * self.cycle_ns
    }

    /// Returns the whole time, or the time of one cycle if there is a gap, s.
    pub fn used_s(self) -> f64 {
        (self.cycle_ns + if self.is_gap() { 0 } else { self.lost_ns }) as f64 * 1e-9
    }

    /// Returns the time of one cycle, s.
    pub fn cycle_s(self) -> f64 {
        self.cycle_ns as f64 * 1e-9
    }

    /// Returns the lost time, s.
    pub fn lost_s(self) -> f64 {
        self.lost_ns as f64 * 1e-9
    }
}

impl Span {
    /// Returns the time since the previous invocation, s, or that of one cycle after a gap; for integrators and filters. Returns 0 in the
    /// first invocation, and in an extra one in the same firing.
    pub fn used(&mut self, invocation: &Invocation) -> f64 {
        self.pass(invocation).used_s()
    }

    /// Returns all the time since the previous invocation, s; for derivatives and predictions of measured values, which continued to
    /// change.
    pub fn elapsed(&mut self, invocation: &Invocation) -> f64 {
        let passed = self.pass(invocation);
        (passed.cycle_ns + passed.lost_ns) as f64 * 1e-9
    }

    /// Returns the time of one cycle and the lost time.
    pub fn pass(&mut self, invocation: &Invocation) -> ElapsedTime {
        let Invocation { number, time_ns, .. } = *invocation;
        let elapsed_ns = if self.begun { time_ns.saturating_sub(self.before_ns).max(0) } else { 0 };
        let cycles = i64::try_from(number.saturating_sub(self.number)).map_or(1, |cycles| cycles.max(1));
        *self = Span { before_ns: time_ns, number, begun: true };
        // A division is expensive at 1 ms, and rarely needed.
        let cycle_ns = if cycles == 1 { elapsed_ns } else { elapsed_ns / cycles };
        ElapsedTime { cycle_ns, lost_ns: elapsed_ns - cycle_ns }
    }

    /// Returns true after the first invocation.
    pub fn begun(&self) -> bool {
        self.begun
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(number: u64, ms: i64) -> Invocation {
        Invocation { number, time_ns: ms * 1_000_000, now_ns: 0 }
    }

    #[test]
    fn the_first_invocation_has_no_span() {
        let mut span = Span::default();
        assert_eq!((span.begun(), span.used(&at(0, 5))), (false, 0.0));
        assert_eq!((span.begun(), span.used(&at(1, 7))), (true, 0.002));
        assert_eq!(span.used(&at(2, 7)), 0.0);
    }

    #[test]
    fn what_is_lost_with_skipped_releases_is_told_apart() {
        let mut span = Span::default();
        span.pass(&at(10, 100));
        assert_eq!(span.pass(&at(60, 1100)), ElapsedTime { cycle_ns: 20_000_000, lost_ns: 980_000_000 });
        assert!((span.used(&at(62, 1140)) - 0.04).abs() < 1e-15, "a little late");
        assert!((span.used(&at(72, 1340)) - 0.02).abs() < 1e-15, "a gap");
        assert!((span.elapsed(&at(74, 1380)) - 0.04).abs() < 1e-15);
    }
}
