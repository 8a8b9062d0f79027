// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::inverse::Ranges;
use crate::kinematics::tool_jog::{Obstacle, ToolJog, Twist, Wish};
use crate::kinematics::{BAD_CHAIN, BAD_LIMIT, BAD_POSE, JOINTS_MAX};
use crate::pace;
use crate::profile::Limits;
use crate::span::Span;
use crate::takeover::{Brake, Tail};
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// Jerk of the tool for unit acceleration, chosen so that the acceleration is reached in a tenth of a second.
const JERK: f64 = 10.0;
/// Angular acceleration of the tool, rad/s², for a linear acceleration of 1 m/s².
const ANGULAR: f64 = 5.0;
/// Value of `blocked` if no joint's range is the cause.
const SINGULAR: i32 = -1;

/// Tool velocity generator: setpoint = q with forward(q) = start + ∫ velocity, straight along the axes of the base or of the tool.
///
/// The tool moves at `velocity` and `angular_velocity` from the current commanded positions, within `acceleration`, and comes to rest
/// after `distance`, when both velocities are 0, when it is held, or when it cannot continue. A change of direction takes effect at rest.
/// Each set-point is accepted only if a stop from there keeps every joint within its range, speed, acceleration and jerk. The tool
/// therefore slows down by itself near singularities and the ends of ranges, comes to rest on its line, and reports `blocked`. Joints
/// that move at the start are braked first. Lost time is not made up for; if the time lost in a single gap exceeds `gap_max`, the tool
/// comes to rest and `gap` is reported. A speed from which stopping takes more than 31 intervals is reduced. Each invocation computes up
/// to 32 solutions of the inverse kinematics, about 10 µs each. Faults: 1 the arm is not a chain of n joints; 2 a start or velocity is
/// not finite; 3 a limit is not above 0, or an override is not between 0 and 1.
#[derive(FunctionBlock)]
pub struct ToolVelocityGenerator {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// current commanded positions of the joints, rad or m
    #[input(asynchronous, sized)]
    start: [f64; 16],
    /// current speed at which the servos move the joints
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    start_velocity: [f64; 16],
    /// speed of the last set-points, whichever motion generated them
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    last_velocity: [f64; 16],
    /// acceleration of the last set-points
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
    last_acceleration: [f64; 16],
    /// time at which the last set-points were stored, ns of the system clock
    #[input(asynchronous, default = [i64::MIN; 16], sized, range = "[-inf, inf)")]
    last_time: [i64; 16],
    /// braking by the servos themselves because set-points did not arrive in time: see `joint_servo`
    #[input(asynchronous, default = [[0.0; 4]; 16], sized, range = "[-inf, inf)")]
    braking: [[f64; 4]; 16],
    /// requested velocity of the tool along x, y, z
    #[input(asynchronous, default = [0.0; 3], unit = "m/s", range = "[-10, 10]")]
    velocity: [f64; 3],
    /// requested angular velocity of the tool about x, y, z
    #[input(asynchronous, default = [0.0; 3], unit = "rad/s", range = "[-100, 100]")]
    angular_velocity: [f64; 3],
    /// true: the axes are those of the tool at the start; false: those of the arm's base
    #[input(asynchronous, default = false)]
    in_tool: bool,
    /// distance to move, m, or rad if the tool only rotates; 0: unlimited
    #[input(asynchronous, default = 0.0, range = "[0, inf)")]
    distance: f64,
    /// maximum acceleration of the tool, m/s²; its maximum angular acceleration is five times this number, in rad/s²
    #[input(asynchronous, default = 0.5, unit = "m/s^2", range = "(0, 1000]")]
    acceleration: f64,
    /// permitted fraction of the velocity, 0 to 1; the minimum over the joints applies to all
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    r#override: [f64; 16],
    /// override of the whole cell; the two are multiplied
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    cell_override: [f64; 16],
    /// true: bring the motion to rest and keep it there
    #[input(asynchronous, default = false)]
    holding: bool,
    /// maximum time lost in a single gap; if it is exceeded, the tool comes to rest
    #[input(asynchronous, default = [0.5; 16], sized, unit = "s", range = "(0, inf)")]
    gap_max: [f64; 16],
    /// maximum speed of each joint
    #[input(asynchronous, default = [std::f64::consts::PI; 16], sized, range = "(0, inf)")]
    speed_max: [f64; 16],
    /// maximum acceleration of each joint
    #[input(asynchronous, default = [5.0; 16], sized, range = "(0, inf)")]
    acceleration_max: [f64; 16],
    /// maximum jerk of each joint
    #[input(asynchronous, default = [50.0; 16], sized, range = "(0, inf)")]
    jerk_max: [f64; 16],
    /// minimum position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized, range = "[-inf, inf)")]
    position_min: [f64; 16],
    /// maximum position of each joint
    #[input(asynchronous, default = [1e6; 16], sized, range = "[-inf, inf)")]
    position_max: [f64; 16],
    /// commanded positions of the joints, rad or m
    #[output(sized)]
    setpoint: [f64; 16],
    /// commanded speed at the set-point, rad/s or m/s
    #[output(sized)]
    setpoint_velocity: [f64; 16],
    /// acceleration of the set-points, rad/s^2 or m/s^2
    #[output(sized)]
    setpoint_acceleration: [f64; 16],
    /// time at which the set-points are stored, ns of the system clock
    #[output(sized)]
    setpoint_time: [i64; 16],
    /// time between two set-points: the interval of this block
    #[param(default = 0.02, unit = "s", range = "(0, inf)")]
    lead: f64,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// the tool is at rest, and has moved by `distance`
    #[condition]
    finished: Condition,
    /// the joints are at rest because they are held, or no motion is requested
    #[condition]
    held: Condition,
    /// the tool is at rest although motion is requested; the value is the joint at the end of its range, from 0, or -1 near a singularity
    /// or at the limit of the reach
    #[condition]
    blocked: ConditionOf<i32>,
    /// the joints are at rest because the time lost in a single gap exceeded `gap_max`; the value is the time lost, s
    #[condition]
    gap: ConditionOf<f64>,
    /// progress of the motion
    #[state(opaque)]
    state: Progress,
}

/// Progress of the motion.
#[derive(Clone, Copy, Debug, Default)]
struct Progress {
    brake: Brake,
    jog: ToolJog,
    tail: Tail,
    span: Span,
    has_begun: bool,
    /// True if the tool is coming to rest because time was lost.
    is_lost: bool,
    lost_s: f64,
}

impl Step for ToolVelocityGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let last = crate::takeover::last_setpoints!(self, n);
        if let Some(now) = self.state.brake.step(&last, &self.acceleration_max[..n], &self.jerk_max[..n], self.lead, true, invocation) {
            (self.setpoint, self.setpoint_velocity, self.setpoint_acceleration) = (now.setpoint, now.velocity, now.acceleration);
            self.setpoint_time = [invocation.now_ns; 16];
            return Outcome::Done;
        }
        let chain = self.chain;
        let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        let are_finite = self.start[..n].iter().chain(&self.velocity).chain(&self.angular_velocity).all(|x| x.is_finite());
        if !are_finite {
            return Outcome::Fault(BAD_POSE);
        }
        let (Some(share), Some(joints)) = (pace::allowed(&self.r#override[..n], &self.cell_override[..n]), self.limits()) else {
            return Outcome::Fault(BAD_LIMIT);
        };
        let passed = self.state.span.pass(invocation);
        self.state.is_lost |= pace::note_lost(passed, &self.gap_max[..n], &mut self.state.lost_s);
        let is_first = !self.state.has_begun;
        if is_first {
            (self.state.has_begun, self.setpoint) = (true, self.start);
            self.state.jog.begin(&self.start);
        }
        let is_held = self.holding || self.state.is_lost;
        let wish = Wish {
            twist: Twist { linear: self.velocity, angular: self.angular_velocity, in_tool: self.in_tool },
            distance: if self.distance > 0.0 { self.distance } else { f64::INFINITY },
            share: if is_held { 0.0 } else { share },
            linear: Limits { speed: f64::INFINITY, acceleration: self.acceleration, jerk: JERK * self.acceleration },
            angular: Limits { speed: f64::INFINITY, acceleration: ANGULAR * self.acceleration, jerk: ANGULAR * JERK * self.acceleration },
            joints: &joints[..n],
            ranges: Ranges { min: &self.position_min[..n], max: &self.position_max[..n] },
            cycle_s: self.lead,
        };
        // An extra invocation in the same firing stores the same set-point.
        if is_first || passed.cycle_ns > 0 {
            self.state.jog.advance(&arm, &wish);
        }
        self.store(n, is_held, invocation.now_ns);
        Outcome::Done
    }
}

impl ToolVelocityGenerator {
    /// Returns the limits of each joint; `None` if any of them, the tool's acceleration or the distance is not positive.
    fn limits(&self) -> Option<[Limits; JOINTS_MAX]> {
        let n = self.n as usize;
        let joints = std::array::from_fn(|i| Limits { speed: self.speed_max[i], acceleration: self.acceleration_max[i], jerk: self.jerk_max[i] });
        let are_fine = joints[..n].iter().all(Limits::are_positive) && self.acceleration.is_finite() && self.acceleration > 0.0 && self.distance >= 0.0 && self.lead > 0.0;
        are_fine.then_some(joints)
    }

    fn store(&mut self, n: usize, is_held: bool, now_ns: i64) {
        let Progress { jog, tail, .. } = &mut self.state;
        self.setpoint[..n].copy_from_slice(&jog.setpoint()[..n]);
        self.setpoint_time = [now_ns; 16];
        let rests = jog.is_at_rest();
        tail.push(&self.setpoint[..n], self.lead, rests, &mut self.setpoint_velocity[..n], &mut self.setpoint_acceleration[..n]);
        if !rests {
            return;
        }
        let (obstacle, has_arrived) = (jog.obstacle(), jog.has_arrived());
        if self.state.is_lost {
            // The motion may resume, if the gap does not end it.
            self.state.is_lost = false;
            self.gap.report(self.state.lost_s);
        }
        let is_wanted = Twist { linear: self.velocity, angular: self.angular_velocity, in_tool: self.in_tool }.speed() > 0.0;
        if has_arrived {
            self.finished.report();
        } else if is_held || !is_wanted {
            self.held.report();
        } else if let Some(obstacle) = obstacle {
            self.blocked.report(match obstacle {
                Obstacle::Limit(joint) => joint as i32,
                Obstacle::Singular => SINGULAR,
            });
        }
    }
}
