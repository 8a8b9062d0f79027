// SPDX-License-Identifier: Apache-2.0
//! Limits of the motion along a piece of the path, and the speeds at which it may begin and end.
use super::span::Bounds;
use crate::online::{Profile, State};
use crate::profile::Limits;

/// Fractions of the joints' acceleration and jerk that the curvature of a piece may use at the maximum speed; the rest is available for
/// changes of speed.
#[derive(Clone, Copy, Debug)]
pub struct Shares {
    pub acceleration: f64,
    pub jerk: f64,
}

/// Shares for moves, along which the speed changes.
pub const OF_MOVES: Shares = Shares { acceleration: 0.5, jerk: 0.5 };
/// Alternative shares for moves, which suit longer, shorter and more curved ones.
const OTHERS_OF_MOVES: [Shares; 6] = [
    Shares { acceleration: 0.1, jerk: 0.1 },
    Shares { acceleration: 0.25, jerk: 0.25 },
    Shares { acceleration: 0.35, jerk: 0.35 },
    Shares { acceleration: 0.65, jerk: 0.65 },
    Shares { acceleration: 0.75, jerk: 0.8 },
    Shares { acceleration: 0.9, jerk: 0.9 },
];
/// Speed between two blends for which the shares of a move are chosen, as a fraction of the speed with the default shares.
const BETWEEN_BLENDS: f64 = 0.5;
/// Shares for blends, which are mostly passed at a constant speed.
pub const OF_BLENDS: Shares = Shares { acceleration: 0.9, jerk: 0.85 };
/// Fraction by which a speed is kept below the one computed by iteration.
const ROUNDING: f64 = 1e-12;
/// Number of Newton iterations. They start from above and converge quadratically.
const STEPS: u32 = 12;

/// Returns the limits of the path coordinate, at most `most`, that keep every joint within its limits in any state: with the derivatives
/// q', q'', q''' with respect to the path coordinate, a joint has the speed q' v, the acceleration q' a + q'' v² and the jerk q' j + 3
/// q'' v a + q''' v³.
pub fn limits(bounds: &Bounds, joints: &[Limits], most: Limits, shares: Shares) -> Limits {
    let mut found = most;
    for ([first, second, third], joint) in bounds.of.iter().zip(joints) {
        let speed = (joint.speed / first).min((shares.acceleration * joint.acceleration / second).sqrt());
        found.speed = found.speed.min(speed).min((shares.jerk * joint.jerk / third).cbrt());
    }
    let v = found.speed;
    for ([first, second, third], joint) in bounds.of.iter().zip(joints) {
        let rest = joint.jerk - third * v * v * v;
        found.acceleration = found.acceleration.min((joint.acceleration - second * v * v) / first).min(rest / (6.0 * second * v));
    }
    for ([first, second, third], joint) in bounds.of.iter().zip(joints) {
        let rest = joint.jerk - third * v * v * v - 3.0 * second * v * found.acceleration;
        found.jerk = found.jerk.min(rest / first);
    }
    found
}

/// Returns the limits of the path coordinate with which a piece is passed fastest, both from rest to rest and between blends.
pub fn fastest(length: f64, bounds: &Bounds, joints: &[Limits], most: Limits) -> Limits {
    let mut best = limits(bounds, joints, most, OF_MOVES);
    let blended = BETWEEN_BLENDS * best.speed;
    let both_s = |limits: Limits| time_s(length, 0.0, 0.0, limits) + time_s(length, blended, blended.min(limits.speed), limits);
    let mut least_s = both_s(best);
    for shares in OTHERS_OF_MOVES {
        let found = limits(bounds, joints, most, shares);
        let span_s = both_s(found);
        if span_s < least_s {
            (best, least_s) = (found, span_s);
        }
    }
    best
}

/// Returns limits whose speed is reduced so that a length takes `duration_s` from rest to rest; if that is 0, returns `limits` unchanged.
/// The error is the minimum duration, s.
pub fn in_duration(length: f64, limits: Limits, duration_s: f64) -> Result<Limits, f64> {
    if duration_s == 0.0 {
        return Ok(limits);
    }
    let least_s = time_s(length, 0.0, 0.0, limits);
    if duration_s < least_s * (1.0 - 1e-9) {
        return Err(least_s);
    }
    let speed = Profile::to_in(State::default(), length, limits, duration_s).at(duration_s / 2.0).velocity;
    Ok(Limits { speed: speed.min(limits.speed), ..limits })
}

/// Returns the maximum speed from which a motion without acceleration can slow down (or speed up) to the speed `end` within `length`.
pub fn reach(end: f64, length: f64, limits: Limits) -> f64 {
    let Limits { acceleration, jerk, .. } = limits;
    // Without a phase of constant acceleration the change takes 2 x, x² = (speed - end) / jerk, and the distance is x (2 end + jerk x²).
    let free = acceleration / jerk;
    let speed = if free * (2.0 * end + jerk * free * free) >= length {
        let mut x = (length / jerk).cbrt().min(if end > 0.0 { length / (2.0 * end) } else { f64::INFINITY });
        for _ in 0..STEPS {
            let slope = 3.0 * jerk * x * x + 2.0 * end;
            if slope <= 0.0 {
                break;
            }
            x = (x - (x * (jerk * x * x + 2.0 * end) - length) / slope).max(0.0);
        }
        end + jerk * x * x
    } else {
        // (speed + end) / 2 ((speed - end) / acceleration + acceleration / jerk) = length
        let half = acceleration * acceleration / (2.0 * jerk);
        (half * half + end * end - 2.0 * half * end + 2.0 * acceleration * length).sqrt() - half
    };
    (speed * (1.0 - ROUNDING)).max(end)
}

/// Returns the time to cover a length from one speed towards another, which the motion need not reach.
pub fn time_s(length: f64, from: f64, to: f64, limits: Limits) -> f64 {
    let start = State { velocity: from, ..State::default() };
    Profile::passing(start, length, to, limits.speed.max(from), limits).map_or(f64::INFINITY, |profile| profile.duration_s())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::samples::numbers;

    #[test]
    fn from_the_speed_that_reaches_the_end_is_met_and_no_higher_one() {
        for seed in 1..2000 {
            let mut number = numbers(seed);
            let limits = Limits { speed: 1e9, acceleration: 10f64.powf(number(-2.0, 2.0)), jerk: 10f64.powf(number(-1.0, 3.0)) };
            let (end, length) = (if seed % 3 == 0 { 0.0 } else { 10f64.powf(number(-3.0, 1.0)) }, 10f64.powf(number(-6.0, 1.0)));
            let speed = reach(end, length, limits);
            let passes = |velocity: f64| Profile::passing(State { velocity, ..State::default() }, length, end, end, limits);
            let found = passes(speed).expect("it is met");
            assert_eq!((found.end_velocity(), speed >= end), (end, true), "seed {seed}");
            assert!(passes(speed * (1.0 + 1e-9) + 1e-12).is_none(), "seed {seed}: a higher speed would do than {speed} to {end} in {length}");
        }
    }

    #[test]
    fn every_state_within_the_limits_of_the_path_keeps_those_of_the_joints() {
        for seed in 1..2000 {
            let mut number = numbers(seed);
            let mut bounds = Bounds::default();
            let joints: Vec<Limits> = (0..6).map(|_| Limits { speed: number(0.5, 3.0), acceleration: number(1.0, 10.0), jerk: number(5.0, 100.0) }).collect();
            bounds.of[..6].iter_mut().flatten().for_each(|of| *of = 10f64.powf(number(-2.0, 3.0)));
            let most = Limits { speed: number(0.1, 3.0), acceleration: 10.0, jerk: 100.0 };
            for shares in [OF_MOVES, OF_BLENDS] {
                let found = limits(&bounds, &joints, most, shares);
                assert!(found.are_positive(), "seed {seed}: {found:?}");
                let Limits { speed: v, acceleration: a, jerk: j } = found;
                for ([first, second, third], joint) in bounds.of.iter().zip(&joints) {
                    assert!(first * v <= joint.speed * (1.0 + 1e-12));
                    assert!(first * a + second * v * v <= joint.acceleration * (1.0 + 1e-12));
                    assert!(first * j + 3.0 * second * v * a + third * v * v * v <= joint.jerk * (1.0 + 1e-12));
                }
            }
        }
    }
}
