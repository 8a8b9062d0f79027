// SPDX-License-Identifier: Apache-2.0
use crate::path::{POINTS_MAX, Passing, Path, plan};
use crate::profile::Limits;
use crate::takeover::Last;
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::PI;

/// A start, way-point or blend is not a finite number, or a blend is below 0.
const NOT_FINITE: u32 = 1;
/// A speed or acceleration limit is not above 0.
const BAD_LIMIT: u32 = 2;

/// Path planner: straight lines in joint space through way-points, q(τ) = qₖ + u (…), joined by parabolic blends of acceleration (u₂ - u₁) w²/(2 d).
///
/// Execute it once; a `path_generator` bound to its path makes the motion. Each way-point says by how much a joint may pass it
/// (`blend`, 0: the arm stops there) and how fast its fastest joint may go on the way there. Every joint keeps its speed and
/// acceleration limits everywhere; the last way-point is reached exactly. Way-points that are one count once, so a list is filled up
/// by repeating its last. Source: Craig, *Introduction to Robotics*, section 7.4. From rest to rest; it allocates nothing. Joints that move are
/// waited for where `waits` says so: their generator brakes them.
/// Faults: 1 a number is not finite or a blend is below 0; 2 a limit is not above 0.
#[derive(FunctionBlock)]
pub struct PathPlanner {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// where the joints are commanded to be now, rad or m
    #[input(asynchronous, sized)]
    start: [f64; 16],
    /// speed at which their servos move them now
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    start_velocity: [f64; 16],
    /// speed of the last set-points, of whatever motion stored them
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    last_velocity: [f64; 16],
    /// acceleration of the last set-points
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
    last_acceleration: [f64; 16],
    /// when they were stored, ns of the system's clock
    #[input(asynchronous, default = [i64::MIN; 16], sized, range = "[-inf, inf)")]
    last_time: [i64; 16],
    /// lead of their servos by themselves, because no set-points came in their time: see `joint_servo`
    #[input(asynchronous, default = [[0.0; 4]; 16], sized, range = "[-inf, inf)")]
    braking: [[f64; 4]; 16],
    /// way-points, one row each; columns beyond n are not used
    #[input(asynchronous)]
    points: [[f64; 16]; POINTS_MAX],
    /// for each way-point: by how much a joint may pass it, rad or m
    #[input(asynchronous, default = [0.0; POINTS_MAX], unit = "rad|m", range = "[0, 100]")]
    blend: [f64; POINTS_MAX],
    /// for each way-point: maximum speed of a joint on the way there, rad/s or m/s
    #[input(asynchronous, default = [0.5; POINTS_MAX], unit = "rad/s|m/s", range = "(0, 100]")]
    speed: [f64; POINTS_MAX],
    /// maximum speed of each joint
    #[input(asynchronous, default = [PI; 16], sized, range = "(0, inf)")]
    speed_max: [f64; 16],
    /// maximum acceleration of each joint
    #[input(asynchronous, default = [5.0; 16], sized, range = "(0, inf)")]
    acceleration_max: [f64; 16],
    /// minimum position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized, range = "[-inf, inf)")]
    position_min: [f64; 16],
    /// maximum position of each joint
    #[input(asynchronous, default = [1e6; 16], sized, range = "[-inf, inf)")]
    position_max: [f64; 16],
    /// the planned path
    #[output]
    path: Path,
    /// the last way-point, for those that compare
    #[output(sized)]
    target: [f64; 16],
    /// planned duration
    #[output(unit = "s")]
    duration: f64,
    /// way-point that `limit` is about, from 0
    #[output]
    refused: i32,
    /// time between two set-points
    #[param(default = 0.02, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// joints that move are waited for, and there is one plan for a start: for a planner that stays active until its generator has braked them
    #[param(default = false)]
    waits: bool,
    /// a way-point is outside the range of a joint; the value is which, from 0
    #[condition]
    limit: ConditionOf<i32>,
    /// true after it has planned
    #[state]
    has_planned: bool,
}

impl Step for PathPlanner {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let last = Last {
            position: &self.start[..n],
            servo_velocity: &self.start_velocity[..n],
            velocity: &self.last_velocity[..n],
            acceleration: &self.last_acceleration[..n],
            time_ns: &self.last_time[..n],
            braking: &self.braking[..n],
        };
        if self.waits && (self.has_planned || last.is_moving(invocation.now_ns, self.lead)) {
            return Outcome::Done;
        }
        self.has_planned = true;
        let positive = |x: &f64| x.is_finite() && *x > 0.0;
        let (Some(limits), true) = (Limits::of_joints(&self.speed_max[..n], &self.acceleration_max[..n]), self.speed.iter().all(positive)) else {
            return Outcome::Fault(BAD_LIMIT);
        };
        let finite = |q: &[f64; 16]| q[..n].iter().all(|x| x.is_finite());
        if !finite(&self.start) || !self.points.iter().all(finite) || !self.blend.iter().all(|b| b.is_finite() && *b >= 0.0) {
            return Outcome::Fault(NOT_FINITE);
        }
        for (k, point) in self.points.iter().enumerate() {
            let outside = |i: &usize| !(self.position_min[*i]..=self.position_max[*i]).contains(&point[*i]);
            if let Some(joint) = (0..n).find(outside) {
                // No path: a generator bound to this one does not move.
                (self.path.plan, self.target, self.duration, self.refused) = (0.0, self.start, 0.0, k as i32);
                self.limit.report(joint as i32);
                return Outcome::Done;
            }
        }
        let passing: [Passing; POINTS_MAX] = std::array::from_fn(|k| Passing { blend: self.blend[k], speed: self.speed[k] });
        self.path = plan((invocation.number + 1) as f64, &self.start[..n], &self.points, &passing, &limits[..n]);
        (self.target, self.duration, self.refused) = (self.points[POINTS_MAX - 1], self.path.duration, -1);
        Outcome::Done
    }
}
