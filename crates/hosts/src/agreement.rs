// SPDX-License-Identifier: Apache-2.0
//! Offset of another host's clocks from this one's, measured by pings.
//!
//! If a ping is sent at t0 and answered at t1 on the other clock, and its answer arrives at t3, the offset is t1 − (t0 + t3) / 2 with an
//! error of at most (t3 − t0) / 2, however the delay is split between the two directions. The ping with the shortest round trip in a
//! window is the most precise; the possible drift of the clocks since that ping is added to the error.
use std::collections::VecDeque;

/// Number of pings in a window.
const WINDOW: usize = 64;
/// Maximum drift between two oscillators, parts per million.
const DRIFT_PPM: i64 = 50;

/// Offset of another host's clocks from this one's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClockOffset {
    /// CLOCK_MONOTONIC of the other host minus this host's, ns; used to convert published times. It may amount to days, because that
    /// clock starts at boot.
    pub clock_offset_ns: i64,
    /// Maximum error of the offset, ns.
    pub uncertainty_ns: i64,
    /// CLOCK_REALTIME of the other host minus this host's, ns, with the same uncertainty. PTP or NTP keeps this offset small.
    pub wall_offset_ns: i64,
}

impl ClockOffset {
    /// Returns the offset from the other host's point of view.
    pub(crate) fn reversed(self) -> Self {
        ClockOffset { clock_offset_ns: -self.clock_offset_ns, wall_offset_ns: -self.wall_offset_ns, ..self }
    }

    /// Returns the larger of the uncertainty and the offset of the wall clocks; this value is compared with the limit.
    pub fn worst_ns(&self) -> i64 {
        self.uncertainty_ns.max(self.wall_offset_ns.saturating_abs())
    }
}

/// Report that the clocks no longer agree within the limit, or that they agree again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClockReport {
    /// Name of the other host.
    pub host: String,
    /// Result of the measurement.
    pub offset: ClockOffset,
    /// Limit, ns.
    pub limit_ns: i64,
    /// True if the offset exceeds the limit.
    pub beyond: bool,
}

/// One ping and its answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ping {
    /// Time at which the ping was sent, on this host's steady clock; `came_ns` is the time at which its answer arrived.
    pub(crate) left_ns: i64,
    pub(crate) came_ns: i64,
    /// Time at which the ping was sent, on this host's wall clock.
    pub(crate) left_wall_ns: i64,
    /// Time at which the ping was answered, on the other host's steady clock.
    pub(crate) answered_ns: i64,
    pub(crate) answered_wall_ns: i64,
}

impl Ping {
    fn round_trip_ns(&self) -> i64 {
        self.came_ns - self.left_ns
    }
}

/// Pings of a window.
#[derive(Debug, Default)]
pub(crate) struct Agreement {
    pings: VecDeque<Ping>,
}

impl Agreement {
    pub(crate) fn add(&mut self, ping: Ping) {
        if ping.round_trip_ns() < 0 {
            return;
        }
        if self.pings.len() == WINDOW {
            self.pings.pop_front();
        }
        self.pings.push_back(ping);
    }

    /// Returns the offset measured by the pings; `None` before the first ping.
    pub(crate) fn offset(&self) -> Option<ClockOffset> {
        let newest_ns = self.pings.back()?.came_ns;
        let uncertainty_ns = |ping: &Ping| ping.round_trip_ns() / 2 + 1 + (newest_ns - ping.came_ns) * DRIFT_PPM / 1_000_000;
        let best = self.pings.iter().min_by_key(|ping| uncertainty_ns(ping))?;
        let half_ns = best.round_trip_ns() / 2;
        Some(ClockOffset {
            clock_offset_ns: best.answered_ns - (best.left_ns + half_ns),
            uncertainty_ns: uncertainty_ns(best),
            wall_offset_ns: best.answered_wall_ns - (best.left_wall_ns + half_ns),
        })
    }

    pub(crate) fn len(&self) -> usize {
        self.pings.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns a ping between clocks that differ by `offset_ns`, with these one-way delays.
    fn ping(left_ns: i64, there_ns: i64, back_ns: i64, offset_ns: i64) -> Ping {
        let answered_ns = left_ns + there_ns + offset_ns;
        Ping { left_ns, came_ns: left_ns + there_ns + back_ns, left_wall_ns: left_ns + 7, answered_ns, answered_wall_ns: answered_ns + 9 }
    }

    #[test]
    fn nothing_is_known_before_the_first_answer() {
        assert_eq!(Agreement::default().offset(), None);
    }

    #[test]
    fn the_quickest_ping_says_most() {
        let mut agreement = Agreement::default();
        agreement.add(ping(0, 900_000, 100_000, 5_000));
        agreement.add(ping(10_000_000, 1_000, 1_000, 5_000));
        agreement.add(ping(20_000_000, 500_000, 0, 5_000));
        let found = agreement.offset().expect("three pings");
        assert_eq!((found.clock_offset_ns, found.wall_offset_ns), (5_000, 5_002));
        assert!(found.uncertainty_ns < 3_000, "{found:?}");
    }

    #[test]
    fn old_pings_leave_the_window() {
        let mut agreement = Agreement::default();
        agreement.add(ping(0, 10, 10, 1_000_000));
        (1..=WINDOW as i64).for_each(|round| agreement.add(ping(round * 1_000_000, 100_000, 100_000, 0)));
        assert_eq!(agreement.offset().map(|found| found.clock_offset_ns), Some(0));
        assert_eq!(agreement.len(), WINDOW);
    }

    proptest! {
        #[test]
        fn the_offset_is_never_more_wrong_than_it_says(
            offset_ns in -1_000_000_000_000_000i64..1_000_000_000_000_000,
            ways in prop::collection::vec((0i64..5_000_000, 0i64..5_000_000), 1..100),
        ) {
            let mut agreement = Agreement::default();
            for (round, (there_ns, back_ns)) in ways.into_iter().enumerate() {
                agreement.add(ping(round as i64 * 100_000_000, there_ns, back_ns, offset_ns));
            }
            let found = agreement.offset().expect("there was a ping");
            prop_assert!((found.clock_offset_ns - offset_ns).abs() <= found.uncertainty_ns);
            prop_assert_eq!(found.reversed().reversed(), found);
        }
    }
}
