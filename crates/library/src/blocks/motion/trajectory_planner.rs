// SPDX-License-Identifier: Apache-2.0
use crate::profile::{COEFFICIENTS, Limits, plan};
use opengpac::{FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::PI;

/// A start or goal is not a finite number.
const NOT_FINITE: u32 = 1;
/// A speed, acceleration or jerk limit is not above 0.
const BAD_LIMIT: u32 = 2;
/// A goal is outside its joint's range.
const OUT_OF_RANGE: u32 = 3;

/// Trajectory planner: a jerk-limited motion q(t) = start + (goal - start) s(t), all joints arriving together, in the shortest time that
/// the limits allow.
///
/// Execute it once; a `setpoint_generator` bound to its coefficients executes the motion. The motion is from rest to rest on a straight
/// line in joint space; the equations are in section 3.4 of Biagiotti and Melchiorri, 2008. It allocates nothing. Faults: 1 a start or
/// goal is not finite; 2 a limit is not above 0; 3 a goal is outside its joint's range (goals are in rad: did you mean degrees, '90
/// deg'?).
#[derive(FunctionBlock)]
pub struct TrajectoryPlanner {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// current commanded positions of the joints
    #[input(asynchronous, sized, unit = "rad|m")]
    start: [f64; 16],
    /// goal positions
    #[input(asynchronous, sized, unit = "rad|m")]
    goal: [f64; 16],
    /// maximum speed of any joint in this motion
    #[input(asynchronous, default = 0.5, unit = "rad/s|m/s", range = "(0, 100]")]
    speed: f64,
    /// maximum speed of each joint
    #[input(asynchronous, default = [PI; 16], sized, unit = "rad/s|m/s", range = "(0, inf)")]
    speed_max: [f64; 16],
    /// maximum acceleration of each joint
    #[input(asynchronous, default = [5.0; 16], sized, unit = "rad/s^2|m/s^2", range = "(0, inf)")]
    acceleration_max: [f64; 16],
    /// maximum jerk of each joint
    #[input(asynchronous, default = [50.0; 16], sized, unit = "rad/s^3|m/s^3", range = "(0, inf)")]
    jerk_max: [f64; 16],
    /// minimum position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized, unit = "rad|m", range = "[-inf, inf)")]
    position_min: [f64; 16],
    /// maximum position of each joint
    #[input(asynchronous, default = [1e6; 16], sized, unit = "rad|m", range = "[-inf, inf)")]
    position_max: [f64; 16],
    /// goal, for comparison by other blocks
    #[output(sized, unit = "rad|m")]
    target: [f64; 16],
    /// planned motion
    #[output]
    coefficients: [f64; COEFFICIENTS],
    /// duration of the motion
    #[output(unit = "s")]
    duration: f64,
}

impl Step for TrajectoryPlanner {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let mut limits = [Limits { speed: 0.0, acceleration: 0.0, jerk: 0.0 }; 16];
        for (i, limit) in limits[..n].iter_mut().enumerate() {
            if !(self.start[i].is_finite() && self.goal[i].is_finite()) {
                return Outcome::Fault(NOT_FINITE);
            }
            *limit = Limits { speed: self.speed.min(self.speed_max[i]), acceleration: self.acceleration_max[i], jerk: self.jerk_max[i] };
            // `min` ignores a NaN, so both speeds are checked.
            let all = [self.speed, self.speed_max[i], limit.acceleration, limit.jerk];
            if !all.iter().all(|x| x.is_finite() && *x > 0.0) {
                return Outcome::Fault(BAD_LIMIT);
            }
            if !(self.position_min[i]..=self.position_max[i]).contains(&self.goal[i]) {
                return Outcome::Fault(OUT_OF_RANGE);
            }
        }
        self.target = self.goal;
        self.coefficients = plan((invocation.number + 1) as f64, &self.start[..n], &self.goal[..n], &limits[..n]);
        self.duration = crate::profile::duration_s(&self.coefficients);
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::{duration_s, evaluate, joints};

    fn planner(start: &[f64], goal: &[f64]) -> TrajectoryPlanner {
        let wide = |values: &[f64]| std::array::from_fn(|i| values.get(i).copied().unwrap_or(f64::NAN));
        TrajectoryPlanner {
            n: start.len() as u32, start: wide(start), goal: wide(goal), speed: 0.5, speed_max: [PI; 16], acceleration_max: [5.0; 16], jerk_max: [50.0; 16],
            position_min: [-6.3; 16], position_max: [6.3; 16], target: [0.0; 16], coefficients: [0.0; COEFFICIENTS], duration: 0.0,
        }
    }

    #[test]
    fn it_plans_the_fastest_joint_at_the_speed_asked_for() {
        let mut planner = planner(&[0.0, 1.0], &[2.0, 0.5]);
        assert_eq!(planner.step(&Invocation::default()), Outcome::Done);
        assert_eq!((joints(&planner.coefficients), &planner.target[..2]), (2, &[2.0, 0.5][..]));
        // 2/0.5 + 0.5/5 + 5/50: the closed form of a motion that just reaches its speed and acceleration limits (0.5 * 50 = 25 = 5^2).
        assert!((duration_s(&planner.coefficients) - 4.2).abs() < 1e-9, "{}", duration_s(&planner.coefficients));
        let (mut q, mut v) = ([0.0; 2], [0.0; 2]);
        evaluate(&planner.coefficients, 2.1, &mut q, &mut v);
        assert!((v[0] - 0.5).abs() < 1e-9 && (v[1] + 0.125).abs() < 1e-9 && (q[1] - 0.75).abs() < 1e-9);
    }

    #[test]
    fn what_cannot_be_planned_is_a_fault_with_its_code() {
        let fault = |change: fn(&mut TrajectoryPlanner)| {
            let mut planner = planner(&[0.0, 1.0], &[2.0, 0.5]);
            change(&mut planner);
            planner.step(&Invocation::default())
        };
        assert_eq!(fault(|p| p.goal[1] = f64::INFINITY), Outcome::Fault(NOT_FINITE));
        assert_eq!(fault(|p| p.speed = 0.0), Outcome::Fault(BAD_LIMIT));
        assert_eq!(fault(|p| p.speed = f64::NAN), Outcome::Fault(BAD_LIMIT));
        assert_eq!(fault(|p| p.jerk_max[0] = -1.0), Outcome::Fault(BAD_LIMIT));
        assert_eq!(fault(|p| p.goal[0] = 90.0), Outcome::Fault(OUT_OF_RANGE));
        assert_eq!(fault(|_| ()), Outcome::Done);
    }
}
