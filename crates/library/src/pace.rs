// SPDX-License-Identifier: Apache-2.0
//! Pace of a planned motion: the rate at which its own time elapses, 1 as planned, 0 at a standstill.
//!
//! With the path time τ and the pace r = dτ/dt, a joint planned at velocity v(τ) and acceleration a(τ) moves at v r and accelerates at a
//! r² + v r'. Thus a motion planned within its limits stays within them at every pace up to 1, as long as r' is small enough: overrides
//! and holds are ramped accordingly.

use crate::span::ElapsedTime;

/// Maximum number of times that the step towards the requested pace is halved.
const HALVINGS: u32 = 48;
/// Fraction by which rounding may exceed a limit.
const ROUNDING: f64 = 1e-9;

/// Returns the acceleration of one coordinate at a pace, from the planned velocity and acceleration, the pace, and the slope of the pace
/// (1/s).
pub fn acceleration(velocity: f64, acceleration: f64, pace: f64, slope: f64) -> f64 {
    acceleration * pace * pace + velocity * slope
}

/// Returns the pace after `pace`, towards `wanted` (clamped to 0 to 1), over `span_s`: the closest one that `fits`. `fits` is called with
/// the pace and its slope at the start and at the end of the span.
pub fn next(pace: f64, wanted: f64, span_s: f64, fits: impl Fn(f64, f64) -> bool) -> f64 {
    let wanted = if wanted > 0.0 { wanted.min(1.0) } else { 0.0 };
    if span_s <= 0.0 || pace == wanted {
        return pace;
    }
    let mut share = 1.0;
    for _ in 0..HALVINGS {
        let after = if share == 1.0 { wanted } else { pace + (wanted - pace) * share };
        if fits(after, (after - pace) / span_s) {
            return after;
        }
        share *= 0.5;
    }
    pace
}

/// Returns the pace that overrides allow: the minimum of the joints' own overrides times the minimum of the cell's, each within 0 to 1;
/// `None` if any of them is outside that range.
pub fn allowed(own: &[f64], cell: &[f64]) -> Option<f64> {
    let least = |shares: &[f64]| shares.iter().try_fold(1.0f64, |least, share| (0.0..=1.0).contains(share).then(|| least.min(*share)));
    Some(least(own)? * least(cell)?)
}

/// Updates `most`, the longest time lost in a single gap so far, s. Returns true if the time lost now exceeds the minimum of these
/// bounds.
pub fn note_lost(passed: ElapsedTime, bounds: &[f64], most: &mut f64) -> bool {
    if passed.lost_ns == 0 {
        return false;
    }
    *most = most.max(passed.lost_s());
    passed.lost_s() > bounds.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Returns true if an acceleration is within ± `limit`.
pub fn within(acceleration: f64, limit: f64) -> bool {
    acceleration.abs() <= limit * (1.0 + ROUNDING)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_cruise_it_ramps_no_faster_than_the_acceleration_allows() {
        // Planned at 2 m/s, 4 m/s^2 allowed: half a second from 1 to 0.
        let fits = |_, slope| within(acceleration(2.0, 0.0, 1.0, slope), 4.0);
        let (mut pace, mut steps) = (1.0, 0);
        while pace > 0.0 {
            let before = pace;
            pace = next(pace, 0.0, 0.02, fits);
            assert!(before - pace <= 0.04 + 1e-9);
            steps += 1;
            assert!(steps < 60, "it comes to rest");
        }
        assert!(steps >= 25);
    }

    #[test]
    fn the_least_override_counts() {
        assert_eq!(allowed(&[1.0, 0.5], &[0.5, 1.0]), Some(0.25));
        assert_eq!((allowed(&[1.1], &[1.0]), allowed(&[1.0], &[f64::NAN]), allowed(&[-0.1], &[1.0])), (None, None, None));
    }

    #[test]
    fn what_no_pace_fits_leaves_it_as_it_is() {
        assert_eq!(next(0.5, 0.0, 0.02, |_, _| false), 0.5);
        assert_eq!(next(0.5, f64::NAN, 0.02, |_, _| true), 0.0, "no number is no permission to move");
        assert_eq!(next(0.5, 7.0, 0.02, |_, _| true), 1.0);
    }
}
