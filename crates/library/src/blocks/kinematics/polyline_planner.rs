// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::inverse::Ranges;
use crate::kinematics::line::Wish;
use crate::kinematics::polyline::{Polyline, plan_polyline, read_poses};
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_LIMIT, BAD_POSE};
use crate::path::{POINTS_MAX, Passing};
use crate::profile::Limits;
use crate::takeover::Last;
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::PI;

/// Polyline planner: straight lines of the tool through poses, position = pₖ + u (…), joined by parabolic blends of acceleration (u₂ - u₁) w²/(2 d).
///
/// Execute it once; a `polyline_generator` bound to its path makes the motion. Each pose says by how much the tool may pass it (`blend`,
/// 0: it stops there) and how fast it may go on the way there; the orientation turns evenly between poses. The whole path is followed
/// by inverse kinematics before anything moves, at 512 points: where it leaves a joint's range, the reach of the arm or comes too near
/// to a singularity, there is no path, only a condition, and `refused` is the pose it was on the way to. The path is slowed down as a
/// whole until no joint exceeds its limits. Poses that are one count once, so a list is filled up by repeating its last. It takes
/// some milliseconds: give it a slow source. It allocates nothing. From rest to rest. Joints that move are
/// waited for where `waits` says so: their generator brakes them.
/// Faults: 1 the chain is not one for n joints; 2 a joint position is not finite or a pose has no unit quaternion; 3 a limit is not
/// above 0 or a blend is below 0.
#[derive(FunctionBlock)]
pub struct PolylinePlanner {
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
    /// poses for the tool, one row each: x y z in m, quaternion w x y z
    #[input(asynchronous, range = "[pose]")]
    poses: [[f64; 7]; POINTS_MAX],
    /// for each pose: by how much the tool may pass it, m
    #[input(asynchronous, default = [0.0; POINTS_MAX], unit = "m", range = "[0, 10]")]
    blend: [f64; POINTS_MAX],
    /// for each pose: maximum speed of the tool on the way there, m/s
    #[input(asynchronous, default = [0.25; POINTS_MAX], unit = "m/s", range = "(0, 10]")]
    speed: [f64; POINTS_MAX],
    /// maximum speed of its orientation
    #[input(asynchronous, default = 1.0, unit = "rad/s", range = "(0, 100]")]
    angular_speed: f64,
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
    path: Polyline,
    /// joint positions at its end, for those that compare
    #[output(sized)]
    target: [f64; 16],
    /// planned duration
    #[output(unit = "s")]
    duration: f64,
    /// pose that a condition is about, from 0
    #[output]
    refused: i32,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// maximum acceleration of the tool
    #[param(default = 1.0, unit = "m/s^2", range = "(0, 1000]")]
    acceleration: f64,
    /// maximum acceleration of its orientation
    #[param(default = 5.0, unit = "rad/s^2", range = "(0, 10000]")]
    angular_acceleration: f64,
    /// minimum part of the speed asked for that is worth going, 0 to 1
    #[param(default = 0.02, range = "[0, 1]")]
    slowest: f64,
    /// time between two set-points
    #[param(default = 0.02, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// joints that move are waited for, and there is one plan for a start: for a planner that stays active until its generator has braked them
    #[param(default = false)]
    waits: bool,
    /// a pose is out of reach; the value is how far, m
    #[condition]
    unreachable: ConditionOf<f64>,
    /// the range of a joint ends on the way; the value is which, from 0
    #[condition]
    limit: ConditionOf<i32>,
    /// a singularity is on the way; the value is the part of the speed that would be possible
    #[condition]
    singular: ConditionOf<f64>,
    /// true after it has planned
    #[state]
    has_planned: bool,
}

impl PolylinePlanner {
    /// Of the position of the tool and of its orientation; `None` where one is not positive, or a blend is below 0.
    fn limits(&self) -> Option<(Limits, Limits)> {
        let fastest = self.speed.iter().fold(0.0, |most: f64, s| most.max(*s));
        let linear = Limits { speed: fastest, acceleration: self.acceleration, jerk: 1.0 };
        let angular = Limits { speed: self.angular_speed, acceleration: self.angular_acceleration, jerk: 1.0 };
        let ways = self.speed.iter().all(|s| s.is_finite() && *s > 0.0) && self.blend.iter().all(|b| b.is_finite() && *b >= 0.0);
        (ways && linear.are_positive() && angular.are_positive()).then_some((linear, angular))
    }
}

impl Step for PolylinePlanner {
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
        let chain = self.chain;
        let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        let (Ok(poses), true) = (read_poses(&self.poses), self.start[..n].iter().all(|q| q.is_finite())) else { return Outcome::Fault(BAD_POSE) };
        let joints = Limits::of_joints(&self.speed_max[..n], &self.acceleration_max[..n]);
        let (Some(joints), Some((linear, angular))) = (joints, self.limits()) else { return Outcome::Fault(BAD_LIMIT) };
        let passing: [Passing; POINTS_MAX] = std::array::from_fn(|k| Passing { blend: self.blend[k], speed: self.speed[k] });
        let ranges = Ranges { min: &self.position_min[..n], max: &self.position_max[..n] };
        let wish = Wish { from: &self.start[..n], goal: Pose::IDENTITY, linear, angular, joints: &joints[..n], ranges, slowest: self.slowest };
        match plan_polyline((invocation.number + 1) as f64, &arm, &poses, &passing, &wish) {
            Ok(path) => {
                (self.path, self.target, self.duration, self.refused) = (path, path.to, path.path.duration, -1);
                return Outcome::Done;
            }
            Err((at, obstacle)) => {
                self.refused = at as i32;
                obstacle.report(&mut self.unreachable, &mut self.limit, &mut self.singular);
            }
        }
        // No path: a generator bound to this one does not move.
        (self.path.path.plan, self.target, self.duration) = (0.0, self.start, 0.0);
        Outcome::Done
    }
}
