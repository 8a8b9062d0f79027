// SPDX-License-Identifier: Apache-2.0
//! Inverse kinematics by damped least squares, within the ranges of the joints.
//!
//! dq = Jᵀ (J Jᵀ + λ)⁻¹ e (Levenberg and Marquardt), with λ proportional to the error, so that the step is a Newton step near the goal,
//! and short near a singularity (Sugihara, *Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method*, IEEE
//! Transactions on Robotics, 2011). A joint at an end of its range that would move beyond it is excluded from the step.
use super::JOINTS_MAX;
use super::chain::{Arm, Posture, gram};
use super::matrix::solve;
use super::pose::{Pose, length};

/// Maximum movement of a joint in one iteration, rad or m, because the linear model is valid only nearby.
const STEP_MAX: f64 = 0.4;
/// Fraction of the tolerance below which an error is accepted, because another iteration would not change anything significant.
const EXACT: f64 = 1e-4;
/// Minimum damping, which keeps the equations solvable with fewer than six joints.
const DAMPING_MIN: f64 = 1e-14;
/// Number of iterations per attempt, sufficient for half a revolution.
const ITERATIONS: u32 = 80;

/// Maximum error at which the goal counts as reached.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// m
    pub position: f64,
    /// Maximum angle, rad.
    pub angle: f64,
    /// True if the orientation must also be reached.
    pub orientation: bool,
}

/// Ranges of the joints, rad or m.
#[derive(Clone, Copy, Debug)]
pub struct Ranges<'a> {
    pub min: &'a [f64],
    pub max: &'a [f64],
}

/// Best solution found.
#[derive(Clone, Copy, Debug)]
pub struct InverseSolution {
    pub q: [f64; JOINTS_MAX],
    /// Distance of the tool from the goal, m.
    pub position_error: f64,
    /// Angle between the tool and the goal, rad; 0 if the orientation is ignored.
    pub angle_error: f64,
    pub reached: bool,
    /// Joint at an end of its range that would have to move beyond it.
    pub stopped_by: Option<usize>,
}

/// Searches for joint positions that reach `goal`, starting from `near`.
pub fn inverse(arm: &Arm, goal: &Pose, near: &[f64], ranges: Ranges, tolerance: Tolerance) -> InverseSolution {
    let mut search = Search::new(arm, goal, near, ranges, tolerance);
    for _ in 0..ITERATIONS {
        if !search.improve() {
            break;
        }
    }
    search.found(tolerance)
}

/// Searches like [`inverse`], but if that fails, retries from other positions within the ranges, up to `attempts` in all. Returns the
/// first solution that reaches the goal, or otherwise the best one.
pub fn inverse_anywhere(arm: &Arm, goal: &Pose, near: &[f64], ranges: Ranges, tolerance: Tolerance, attempts: u32) -> InverseSolution {
    let mut best = inverse(arm, goal, near, ranges, tolerance);
    for attempt in 1..attempts.max(1) {
        if best.reached {
            break;
        }
        let mut from = [0.0; JOINTS_MAX];
        for (i, from) in from.iter_mut().enumerate().take(near.len()) {
            // Beyond half a turn in either direction there is nothing new for a hinge.
            let (low, high) = (ranges.min[i].max(near[i] - std::f64::consts::PI), ranges.max[i].min(near[i] + std::f64::consts::PI));
            *from = if arm.moves(i) { low + (high - low) * halton(attempt, i) } else { near[i] };
        }
        let other = inverse(arm, goal, &from[..near.len()], ranges, tolerance);
        if other.reached || other.position_error + other.angle_error < best.position_error + best.angle_error {
            best = other;
        }
    }
    best
}

/// Returns the joint whose range prevents the arm from reaching the goal: the joint stopped at an end of its range, if the goal could be
/// reached without ranges.
pub fn in_the_way(arm: &Arm, goal: &Pose, near: &[f64], found: &InverseSolution, tolerance: Tolerance, attempts: u32) -> Option<usize> {
    let joint = found.stopped_by?;
    let turn = |sign: f64| -> [f64; JOINTS_MAX] { std::array::from_fn(|i| near.get(i).map_or(0.0, |q| q + sign * 2.0 * std::f64::consts::PI)) };
    let (min, max) = (turn(-1.0), turn(1.0));
    let free = inverse_anywhere(arm, goal, near, Ranges { min: &min, max: &max }, tolerance, attempts);
    free.reached.then_some(joint)
}

/// Returns the i-th number of the Halton sequence for a prime base; the numbers are spread evenly over 0 to 1.
fn halton(index: u32, dimension: usize) -> f64 {
    const PRIMES: [u32; JOINTS_MAX] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];
    let base = PRIMES[dimension];
    let (mut rest, mut part, mut value) = (index, 1.0, 0.0);
    while rest > 0 {
        part /= f64::from(base);
        value += part * f64::from(rest % base);
        rest /= base;
    }
    value
}

struct Search<'a> {
    arm: &'a Arm<'a>,
    goal: &'a Pose,
    ranges: Ranges<'a>,
    tolerance: Tolerance,
    q: [f64; JOINTS_MAX],
    /// Posture at q, and the error that remains.
    posture: Posture,
    error: [f64; 6],
    /// Damping factor, which increases when a step has made the error worse.
    caution: f64,
    stopped_by: Option<usize>,
}

impl<'a> Search<'a> {
    fn new(arm: &'a Arm<'a>, goal: &'a Pose, near: &[f64], ranges: Ranges<'a>, tolerance: Tolerance) -> Search<'a> {
        let mut q = [0.0; JOINTS_MAX];
        for (i, q) in q.iter_mut().enumerate().take(near.len()) {
            *q = near[i].max(ranges.min[i]).min(ranges.max[i]);
        }
        let posture = arm.posture(&q[..arm.joints()]);
        let mut search = Search { arm, goal, ranges, tolerance, q, posture, error: [0.0; 6], caution: 1.0, stopped_by: None };
        search.error = search.error_at(&posture);
        search
    }

    fn error_at(&self, posture: &Posture) -> [f64; 6] {
        let (way, turn) = posture.tool.to(self.goal);
        let turn = if self.tolerance.orientation { turn } else { [0.0; 3] };
        [way[0], way[1], way[2], turn[0], turn[1], turn[2]]
    }

    /// Makes one step; returns false if the error cannot be reduced further.
    fn improve(&mut self) -> bool {
        const CAUTION_MAX: f64 = 1e8;
        let now = square(&self.error);
        if now.sqrt() < EXACT * self.tolerance.position.min(self.tolerance.angle) {
            return false;
        }
        let n = self.arm.joints();
        let mut rows = self.arm.jacobian(&self.posture);
        if !self.tolerance.orientation {
            rows.iter_mut().for_each(|row| row[3..].fill(0.0));
        }
        while self.caution < CAUTION_MAX {
            let step = self.step(&rows, now);
            let mut q = self.q;
            for i in 0..n {
                q[i] = (q[i] + step[i]).max(self.ranges.min[i]).min(self.ranges.max[i]);
            }
            let posture = self.arm.posture(&q[..n]);
            let error = self.error_at(&posture);
            if square(&error) < now {
                (self.q, self.posture, self.error) = (q, posture, error);
                self.caution = (self.caution * 0.25).max(1e-3);
                return true;
            }
            self.caution *= 8.0;
        }
        false
    }

    /// Computes the damped step, excluding the joints that would leave their ranges.
    fn step(&mut self, rows: &[[f64; 6]; JOINTS_MAX], error_square: f64) -> [f64; JOINTS_MAX] {
        let n = self.arm.joints();
        let mut rows = *rows;
        self.stopped_by = None;
        for _ in 0..=n {
            let step = damped(&rows[..n], &self.error, DAMPING_MIN + self.caution * 0.1 * error_square);
            let outward = |i: &usize| {
                let further = self.q[*i] + step[*i];
                (self.q[*i] <= self.ranges.min[*i] && further < self.ranges.min[*i]) || (self.q[*i] >= self.ranges.max[*i] && further > self.ranges.max[*i])
            };
            match (0..n).find(outward) {
                Some(joint) => {
                    self.stopped_by = Some(joint);
                    rows[joint] = [0.0; 6];
                }
                None => return step,
            }
        }
        [0.0; JOINTS_MAX]
    }

    fn found(&self, tolerance: Tolerance) -> InverseSolution {
        let position_error = length([self.error[0], self.error[1], self.error[2]]);
        let angle_error = length([self.error[3], self.error[4], self.error[5]]);
        let reached = position_error <= tolerance.position && angle_error <= tolerance.angle;
        InverseSolution { q: self.q, position_error, angle_error, reached, stopped_by: if reached { None } else { self.stopped_by } }
    }
}

fn square(error: &[f64; 6]) -> f64 {
    error.iter().map(|e| e * e).sum()
}

/// Computes Jᵀ (J Jᵀ + λ)⁻¹ e for a Jacobian with one row for each joint; the whole step is shortened if a joint would move too far.
pub fn damped(rows: &[[f64; 6]], error: &[f64; 6], damping: f64) -> [f64; JOINTS_MAX] {
    let mut a = gram(rows);
    for (i, row) in a.iter_mut().enumerate() {
        row[i] += damping;
    }
    let mut step = [0.0; JOINTS_MAX];
    if let Some(x) = solve(&a, error) {
        for (step, row) in step.iter_mut().zip(rows) {
            *step = row.iter().zip(&x).map(|(j, x)| j * x).sum();
        }
    }
    let most = step.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
    if most > STEP_MAX {
        step.iter_mut().for_each(|s| *s *= STEP_MAX / most);
    }
    step
}

#[cfg(test)]
mod tests {
    use super::super::chain::samples::{planar, six_joints};
    use super::*;

    const FINE: Tolerance = Tolerance { position: 1e-9, angle: 1e-9, orientation: true };
    const WIDE: Ranges = Ranges { min: &[-6.3; 6], max: &[6.3; 6] };

    #[test]
    fn it_comes_back_to_a_pose_that_the_arm_can_have() {
        let chain = six_joints();
        let arm = chain.read(6).expect("a chain");
        for seed in 0..200 {
            let q: [f64; 6] = std::array::from_fn(|i| 4.0 * halton(seed + 1, i) - 2.0);
            let goal = arm.posture(&q).tool;
            let near: [f64; 6] = std::array::from_fn(|i| q[i] + 0.3 * ((seed as usize * 7 + i * 5) as f64).sin());
            let found = inverse_anywhere(&arm, &goal, &near, WIDE, FINE, 30);
            assert!(found.reached, "{seed}: {} m, {} rad", found.position_error, found.angle_error);
            let (way, turn) = arm.posture(&found.q[..6]).tool.to(&goal);
            assert!(length(way) < 1e-9 && length(turn) < 1e-9);
        }
    }

    #[test]
    fn out_of_reach_it_points_there_and_says_how_far_it_is() {
        let chain = planar();
        let arm = chain.read(2).expect("a chain");
        let goal = Pose { position: [0.0, 2.0, 0.0], ..Pose::IDENTITY };
        let tolerance = Tolerance { orientation: false, ..FINE };
        let found = inverse(&arm, &goal, &[0.4, 0.4], Ranges { min: &[-3.0; 2], max: &[3.0; 2] }, tolerance);
        assert!(!found.reached && found.stopped_by.is_none());
        assert!((found.position_error - 0.5).abs() < 1e-6, "{}", found.position_error);
    }

    #[test]
    fn a_range_is_respected_and_named() {
        let chain = planar();
        let arm = chain.read(2).expect("a chain");
        let goal = arm.posture(&[1.5, 0.5]).tool;
        let tolerance = Tolerance { orientation: false, ..FINE };
        let found = inverse(&arm, &goal, &[0.2, 0.3], Ranges { min: &[-1.0; 2], max: &[1.0, 3.0] }, tolerance);
        assert_eq!((found.reached, found.stopped_by), (false, Some(0)));
        assert!(found.q[0] <= 1.0);
        assert_eq!(in_the_way(&arm, &goal, &[0.2, 0.3], &found, tolerance, 1), Some(0));
        // If no range would make the goal reachable, no joint is to blame.
        let far = Pose { position: [0.0, 2.0, 0.0], ..goal };
        let found = inverse(&arm, &far, &[0.2, 0.3], Ranges { min: &[-1.0; 2], max: &[1.0, 3.0] }, tolerance);
        assert_eq!((found.stopped_by, in_the_way(&arm, &far, &[0.2, 0.3], &found, tolerance, 1)), (Some(0), None));
    }
}
