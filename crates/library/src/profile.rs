// SPDX-License-Identifier: Apache-2.0
//! Jerk-limited motion of several joints along a straight line in joint space, from rest to rest.
//!
//! Joint i is at start_i + (goal_i - start_i) s(t). The path coordinate s runs from 0 to 1 with the maximum speed, acceleration and jerk
//! that all joints' limits allow (limit_i / |goal_i - start_i|, the minimum over the joints), so that all joints start and arrive
//! together, and each phase is a cubic: jerk up, constant acceleration, jerk down, constant speed, and the mirror image. This is the
//! shortest time along that line (Biagiotti and Melchiorri, *Trajectory Planning for Automatic Machines and Robots*, 2008, section 3.4).
//! It needs no memory other than its coefficients, so a planner can run on the real-time path.

/// Maximum number of joints of one motion.
pub const JOINTS_MAX: usize = 16;
/// Number of coefficients of a planned motion, in this order: number of the plan (1, 2, …; 0 if there is none yet), joints, duration (s),
/// duration of each jerk phase (s), of constant acceleration (s), of constant speed (s), jerk of s (1/s³), 0, then 16 starts and 16
/// goals.
pub const COEFFICIENTS: usize = 8 + 2 * JOINTS_MAX;
/// Coefficients of a planned motion, as exchanged between blocks.
pub type Coefficients = [f64; COEFFICIENTS];

const PLAN: usize = 0;
const JOINTS: usize = 1;
const DURATION: usize = 2;
const JERK_TIME: usize = 3;
const ACCELERATION_TIME: usize = 4;
const CRUISE_TIME: usize = 5;
const JERK: usize = 6;
const START: usize = 8;
const GOAL: usize = START + JOINTS_MAX;

/// Limits of one joint, all positive: rad/s, rad/s², rad/s³ (or the same in metres).
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    pub speed: f64,
    pub acceleration: f64,
    pub jerk: f64,
}

impl Limits {
    /// Returns true if all limits are finite numbers above 0.
    pub fn are_positive(&self) -> bool {
        [self.speed, self.acceleration, self.jerk].iter().all(|limit| limit.is_finite() && *limit > 0.0)
    }

    /// Returns the limits of joints with unlimited jerk; `None` if any is not positive.
    pub fn of_joints(speed: &[f64], acceleration: &[f64]) -> Option<[Limits; JOINTS_MAX]> {
        let mut limits = [Limits { speed: 0.0, acceleration: 0.0, jerk: 1.0 }; JOINTS_MAX];
        for (limit, (speed, acceleration)) in limits.iter_mut().zip(speed.iter().zip(acceleration)) {
            (limit.speed, limit.acceleration) = (*speed, *acceleration);
        }
        limits[..speed.len()].iter().all(Limits::are_positive).then_some(limits)
    }
}

/// Phase times of s: 2 (2 jerk + acceleration) + cruise.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Phases {
    jerk_s: f64,
    acceleration_s: f64,
    cruise_s: f64,
    jerk: f64,
}

/// Plans motion number `plan` (from 1) of `start.len()` joints. The three slices have equal length, at most [`JOINTS_MAX`]; the caller
/// must have checked that every number is finite and every limit positive. If start and goal coincide, the duration is 0.
pub fn plan(plan: f64, start: &[f64], goal: &[f64], limits: &[Limits]) -> Coefficients {
    let mut most = Limits { speed: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };
    let mut coefficients = [0.0; COEFFICIENTS];
    for (i, limit) in limits.iter().enumerate() {
        let way = (goal[i] - start[i]).abs();
        if way > 0.0 {
            most.speed = most.speed.min(limit.speed / way);
            most.acceleration = most.acceleration.min(limit.acceleration / way);
            most.jerk = most.jerk.min(limit.jerk / way);
        }
        coefficients[START + i] = start[i];
        coefficients[GOAL + i] = goal[i];
    }
    let phases = if most.speed.is_finite() { phases(most) } else { Phases { jerk_s: 0.0, acceleration_s: 0.0, cruise_s: 0.0, jerk: 0.0 } };
    coefficients[PLAN] = plan;
    coefficients[JOINTS] = limits.len() as f64;
    coefficients[DURATION] = 2.0 * (2.0 * phases.jerk_s + phases.acceleration_s) + phases.cruise_s;
    coefficients[JERK_TIME] = phases.jerk_s;
    coefficients[ACCELERATION_TIME] = phases.acceleration_s;
    coefficients[CRUISE_TIME] = phases.cruise_s;
    coefficients[JERK] = phases.jerk;
    coefficients
}

/// Computes the phases over a distance of 1. If the distance is too short for a phase, that phase is omitted.
fn phases(most: Limits) -> Phases {
    let Limits { speed: v, acceleration: a, jerk: j } = most;
    // With constant speed: acceleration is reached only if speeding up to v takes longer than 2 a/j.
    let (mut jerk_s, mut acceleration_s) = if v * j > a * a { (a / j, v / a - a / j) } else { ((v / j).sqrt(), 0.0) };
    let mut cruise_s = 1.0 / v - (2.0 * jerk_s + acceleration_s);
    if cruise_s < 0.0 {
        cruise_s = 0.0;
        // Without constant speed: the peak speed w satisfies w (w/a + a/j) = 1 if acceleration is reached, else 2 j jerk_s³ = 1.
        jerk_s = a / j;
        acceleration_s = ((jerk_s * jerk_s + 4.0 / a).sqrt() - 3.0 * jerk_s) / 2.0;
        if acceleration_s < 0.0 {
            (jerk_s, acceleration_s) = ((0.5 / j).cbrt(), 0.0);
        }
    }
    // The jerk that makes the distance exactly 1, in spite of rounding in the square roots.
    let speed_of_jerk = jerk_s * (jerk_s + acceleration_s);
    let jerk = 1.0 / (speed_of_jerk * (2.0 * jerk_s + acceleration_s + cruise_s));
    Phases { jerk_s, acceleration_s, cruise_s, jerk }
}

/// Returns the number of the plan; 0 if there is none yet.
pub fn number(coefficients: &Coefficients) -> f64 {
    coefficients[PLAN]
}

/// Returns the number of joints of the motion.
pub fn joints(coefficients: &Coefficients) -> usize {
    coefficients[JOINTS] as usize
}

/// Returns the planned duration, s.
pub fn duration_s(coefficients: &Coefficients) -> f64 {
    coefficients[DURATION]
}

/// Computes the position and speed of each joint at `time_s`. Before time 0, the joints are at the start; after the duration has elapsed,
/// they are exactly at the goal.
pub fn evaluate(coefficients: &Coefficients, time_s: f64, position: &mut [f64], speed: &mut [f64]) {
    let ended = time_s >= coefficients[DURATION];
    let (s, rate) = if ended { (1.0, 0.0) } else { path(coefficients, time_s.max(0.0)) };
    for i in 0..position.len() {
        let (start, goal) = (coefficients[START + i], coefficients[GOAL + i]);
        position[i] = if ended { goal } else { start + (goal - start) * s };
        speed[i] = (goal - start) * rate;
    }
}

/// Returns s and its rate at a given time within the motion. The second half mirrors the first: s(t) = 1 - s(duration - t).
fn path(coefficients: &Coefficients, time_s: f64) -> (f64, f64) {
    let duration = coefficients[DURATION];
    if time_s > duration / 2.0 {
        let (s, rate) = path(coefficients, duration - time_s);
        return (1.0 - s, rate);
    }
    let (tj, ta, j) = (coefficients[JERK_TIME], coefficients[ACCELERATION_TIME], coefficients[JERK]);
    let after = |from: (f64, f64, f64), jerk: f64, t: f64| {
        let (s, v, a) = from;
        (s + t * (v + t * (a / 2.0 + t * jerk / 6.0)), v + t * (a + t * jerk / 2.0), a + t * jerk)
    };
    let mut state = (0.0, 0.0, 0.0);
    let mut left = time_s;
    for (length, jerk) in [(tj, j), (ta, 0.0), (tj, -j)] {
        if left <= length {
            let (s, v, _) = after(state, jerk, left);
            return (s, v);
        }
        state = after(state, jerk, length);
        left -= length;
    }
    (state.0 + state.1 * left, state.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from a small deterministic generator, so that every run checks the same cases.
    fn numbers(seed: u64) -> impl FnMut(f64, f64) -> f64 {
        let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move |low, high| {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            low + (high - low) * ((x >> 11) as f64 / (1u64 << 53) as f64)
        }
    }

    #[test]
    fn no_limit_is_exceeded_and_all_joints_end_at_rest_at_their_goals() {
        for seed in 1..400 {
            let mut number = numbers(seed);
            let n = 1 + (seed as usize % JOINTS_MAX);
            let start: Vec<f64> = (0..n).map(|_| number(-3.0, 3.0)).collect();
            let scale = 10f64.powf(number(-4.0, 0.5));
            let goal: Vec<f64> = start.iter().map(|s| s + scale * number(-2.0, 2.0)).collect();
            let limits: Vec<Limits> = (0..n).map(|_| Limits { speed: number(0.1, 3.0), acceleration: number(0.5, 10.0), jerk: number(1.0, 100.0) }).collect();
            let c = plan(1.0, &start, &goal, &limits);
            let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
            let steps = 2000;
            let dt = duration_s(&c) / steps as f64;
            let mut speeds: Vec<Vec<f64>> = Vec::new();
            for k in 0..=steps {
                evaluate(&c, k as f64 * dt, &mut q, &mut v);
                for i in 0..n {
                    assert!(v[i].abs() <= limits[i].speed * (1.0 + 1e-9), "seed {seed}: speed of joint {i}");
                    let (low, high) = (start[i].min(goal[i]), start[i].max(goal[i]));
                    assert!(q[i] >= low - 1e-12 && q[i] <= high + 1e-12, "seed {seed}: joint {i} overshoots");
                }
                speeds.push(v.clone());
            }
            for i in 0..n {
                for k in 1..steps {
                    let acceleration = (speeds[k + 1][i] - speeds[k - 1][i]) / (2.0 * dt);
                    let jerk = (speeds[k + 1][i] - 2.0 * speeds[k][i] + speeds[k - 1][i]) / (dt * dt);
                    assert!(acceleration.abs() <= limits[i].acceleration * (1.0 + 1e-6), "seed {seed}: acceleration of joint {i}");
                    assert!(jerk.abs() <= limits[i].jerk * (1.0 + 1e-3), "seed {seed}: jerk {jerk} of joint {i}, limit {}", limits[i].jerk);
                }
            }
            evaluate(&c, duration_s(&c), &mut q, &mut v);
            assert_eq!((q.clone(), v), (goal.clone(), vec![0.0; n]), "seed {seed}: the end");
            evaluate(&c, duration_s(&c) - 1e-9, &mut q, &mut vec![0.0; n]);
            assert!(q.iter().zip(&goal).all(|(q, g)| (q - g).abs() < 1e-9), "seed {seed}: no jump at the end");
        }
    }

    #[test]
    fn some_limit_is_reached_so_that_no_time_is_lost() {
        for seed in 1..400 {
            let mut number = numbers(seed);
            let limit = Limits { speed: number(0.1, 3.0), acceleration: number(0.5, 10.0), jerk: number(1.0, 100.0) };
            let way = 10f64.powf(number(-4.0, 1.0));
            let c = plan(1.0, &[0.0], &[way], &[limit]);
            let jerk = c[JERK] * way;
            assert!((jerk / limit.jerk - 1.0).abs() < 1e-9, "seed {seed}: jerk {jerk}, limit {}", limit.jerk);
            let (mut q, mut v) = ([0.0], [0.0]);
            evaluate(&c, duration_s(&c) / 2.0, &mut q, &mut v);
            if c[CRUISE_TIME] > 0.0 {
                assert!((v[0] / limit.speed - 1.0).abs() < 1e-9, "seed {seed}: cruises below its speed");
            } else if c[ACCELERATION_TIME] > 0.0 {
                assert!((c[JERK_TIME] * jerk / limit.acceleration - 1.0).abs() < 1e-9, "seed {seed}: accelerates below its limit");
            }
            assert!((q[0] - way / 2.0).abs() < 1e-9 * way, "seed {seed}: half way at half time");
        }
    }

    /// Each row contains distance, speed, acceleration and jerk, followed by the results of ruckig 0.19.4 (PyPI): the duration, and the
    /// position after 0.3 of it.
    #[test]
    fn one_joint_moves_as_ruckig_moves_it() {
        let cases = [
            ([3.0, 1.0, 2.0, 8.0], 3.75, 0.75),
            ([0.5, 1.0, 2.0, 8.0], 1.2807764064044151, 0.07241004114120086),
            ([0.05, 1.0, 2.0, 8.0], 0.5848035476425733, 0.007133333333333335),
            ([2.0, 0.5, 10.0, 20.0], 4.316227766016837, 0.5683772233983161),
            ([0.001, 3.0, 5.0, 50.0], 0.08617738760127534, 0.0001426666666666666),
            ([6.0, 3.0, 5.0, 50.0], 2.7, 1.38),
            ([0.9, 1.3, 1.7, 2.9], 2.1494705372109677, 0.12839999999999996),
        ];
        for ([way, speed, acceleration, jerk], duration, third) in cases {
            let c = plan(1.0, &[0.0], &[way], &[Limits { speed, acceleration, jerk }]);
            let mut q = [0.0];
            evaluate(&c, 0.3 * duration, &mut q, &mut [0.0]);
            assert!((duration_s(&c) - duration).abs() < 1e-12 && (q[0] - third).abs() < 1e-12, "way {way}: {} s, {} after 0.3", duration_s(&c), q[0]);
        }
    }

    #[test]
    fn a_long_move_has_the_duration_of_the_textbook() {
        // v = 1, a = 2, j = 8, distance 3: 3/1 + 1/2 + 2/8 s.
        let c = plan(1.0, &[0.0], &[3.0], &[Limits { speed: 1.0, acceleration: 2.0, jerk: 8.0 }]);
        assert!((duration_s(&c) - 3.75).abs() < 1e-12);
    }

    #[test]
    fn a_move_to_where_it_is_takes_no_time() {
        let c = plan(1.0, &[0.5], &[0.5], &[Limits { speed: 1.0, acceleration: 1.0, jerk: 1.0 }]);
        let (mut q, mut v) = ([0.0], [9.0]);
        evaluate(&c, 0.0, &mut q, &mut v);
        assert_eq!((duration_s(&c), q, v), (0.0, [0.5], [0.0]));
    }
}
