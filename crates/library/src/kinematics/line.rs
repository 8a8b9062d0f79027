// SPDX-License-Identifier: Apache-2.0
//! A straight line or an arc of the tool, planned as a whole before anything moves.
//!
//! The tool moves from its pose at `from` along a [`Course`], with a jerk-limited profile s(t). The plan follows the course by inverse
//! kinematics at [`SAMPLES`] points. Thus a line that leaves a joint's range or the reach of the arm is detected before the motion
//! begins, and the speed is the maximum that the joints can follow at the most demanding point: with q' = dq/ds and q'' = d²q/ds² there,
//! ṡ ≤ v/|q'|, ṡ² ≤ a/(2 |q''|), s̈ ≤ a/(2 |q'|) keep every joint within its speed v and acceleration a.
pub(crate) mod planner;

use super::JOINTS_MAX;
use super::chain::Arm;
use super::course::Course;
use super::inverse::{InverseSolution, Ranges, Tolerance, in_the_way, inverse, inverse_anywhere};
use super::pose::{Pose, length, scale, subtract};
use crate::profile::{Coefficients, Limits, plan};
use opengpac::{ConditionOf, Type};

/// Number of points of a line, or of half a circle, at which a plan is checked.
pub const SAMPLES: usize = 128;
/// Maximum distance of the tool from the line, m and rad.
pub const ON_THE_LINE: Tolerance = Tolerance { position: 1e-7, angle: 1e-7, orientation: true };
/// Joint step between adjacent points above which the arm counts as having changed its posture.
const LEAP: f64 = 0.5;
/// Number of starting positions from which the goal of an infeasible line is tried, to determine the reason.
const ATTEMPTS: u32 = 4;

/// A planned line or arc. Poses are x y z (m), then the quaternion w x y z.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Line {
    /// Number of the plan: 1, 2, …; 0 if there is none yet.
    pub plan: f64,
    /// Number of joints.
    pub joints: i32,
    /// Joint positions at the start.
    pub from: [f64; JOINTS_MAX],
    /// Joint positions at the end.
    pub to: [f64; JOINTS_MAX],
    /// Course of the tool.
    pub course: Course,
    /// Maximum acceleration of s, 1/s².
    pub slope: f64,
    /// Profile of s, from 0 to 1.
    pub profile: Coefficients,
}

/// Requested line.
#[derive(Clone, Copy, Debug)]
pub struct Wish<'a> {
    pub from: &'a [f64],
    pub goal: Pose,
    /// Limits of the tool's position, m/s, m/s², m/s³.
    pub linear: Limits,
    /// Limits of the tool's orientation, rad/s, rad/s², rad/s³.
    pub angular: Limits,
    /// Limits of each joint; the jerk is not used.
    pub joints: &'a [Limits],
    pub ranges: Ranges<'a>,
    /// Minimum acceptable fraction of the requested speed.
    pub slowest: f64,
}

/// Reason why a line cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Obstacle {
    /// The goal is unreachable; the value is the distance of the tool from it, m.
    Unreachable(f64),
    /// The line leaves the range of this joint.
    Limit(usize),
    /// The arm comes so close to a singularity that only this fraction of the speed is possible.
    Singular(f64),
}

impl Obstacle {
    /// Reports the obstacle as the corresponding condition of a planner.
    pub fn report(self, unreachable: &mut ConditionOf<f64>, limit: &mut ConditionOf<i32>, singular: &mut ConditionOf<f64>) {
        match self {
            Obstacle::Unreachable(distance) => unreachable.report(distance),
            Obstacle::Limit(joint) => limit.report(joint as i32),
            Obstacle::Singular(part) => singular.report(part),
        }
    }
}

/// Plans line number `number` (from 1) along a course from the pose of the tool. The caller must have checked that numbers are finite and
/// limits positive.
pub fn plan_line(number: f64, arm: &Arm, course: &Course, wish: &Wish) -> Result<Line, Obstacle> {
    let n = arm.joints();
    let start = arm.posture(wish.from).tool;
    let (distance, angle) = course.lengths();
    let mut line = Line { plan: number, joints: n as i32, course: *course, slope: 1.0, ..<Line as Type>::zero() };
    line.from[..n].copy_from_slice(wish.from);
    line.to = line.from;
    // A distance below the resolution of the arm needs no motion.
    if distance < ON_THE_LINE.position / 10.0 && angle < ON_THE_LINE.angle / 10.0 {
        line.profile = plan(number, &[1.0], &[1.0], &[wish.linear]);
        return Ok(line);
    }
    let turning = if course.turns_unevenly() { uneven(course, &start, &wish.angular) } else { part_of(&wish.angular, angle, &UNBOUNDED) };
    let asked = part_of(&course.along_it(wish.linear), distance, &turning);
    let mut most = asked;
    let (mut before, mut here) = (line.from, line.from);
    let (samples, pace) = samples(course);
    for k in 1..=samples {
        let place = course.at(&start, k as f64 * pace);
        // The goal of an arc gives no information about the path to it: the pose itself may be out of reach.
        let goal = if course.is_bent() { place } else { wish.goal };
        let ahead = next(arm, &place, &here, &Wish { goal, ..*wish })?;
        for (i, limit) in wish.joints.iter().enumerate() {
            let rate = (ahead[i] - here[i]).abs() / pace;
            let bend = if k == 1 { 0.0 } else { (ahead[i] - 2.0 * here[i] + before[i]).abs() / (pace * pace) };
            most.speed = most.speed.min(limit.speed / rate).min((0.5 * limit.acceleration / bend).sqrt());
            most.acceleration = most.acceleration.min(0.5 * limit.acceleration / rate);
        }
        (before, here) = (here, ahead);
    }
    if most.speed < wish.slowest * asked.speed {
        return Err(Obstacle::Singular(most.speed / asked.speed));
    }
    (line.to, line.slope) = (here, most.acceleration);
    line.profile = plan(number, &[0.0], &[1.0], &[most]);
    Ok(line)
}

/// Returns the number of points of a course at which a plan is checked, and their spacing.
fn samples(course: &Course) -> (usize, f64) {
    let samples = SAMPLES * ((course.angle / std::f64::consts::PI).ceil() as usize).max(1);
    (samples, 1.0 / samples as f64)
}

/// Returns the limits of s that keep a turn about a changing axis within the limits of the orientation at every point, in the same way as
/// for the joints.
fn uneven(course: &Course, start: &Pose, angular: &Limits) -> Limits {
    let (samples, pace) = samples(course);
    let (mut here, mut before) = (*start, [0.0; 3]);
    let mut most = UNBOUNDED;
    for k in 1..=samples {
        let ahead = course.at(start, k as f64 * pace);
        let rate = scale(here.to(&ahead).1, 1.0 / pace);
        let bend = if k == 1 { 0.0 } else { length(subtract(rate, before)) / pace };
        most.speed = most.speed.min(angular.speed / length(rate)).min((0.5 * angular.acceleration / bend).sqrt());
        most.acceleration = most.acceleration.min(0.5 * angular.acceleration / length(rate));
        most.jerk = most.jerk.min(angular.jerk / length(rate));
        (here, before) = (ahead, rate);
    }
    most
}

const UNBOUNDED: Limits = Limits { speed: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };

/// Returns the limits of s for a path of this length, at most `most`.
fn part_of(limits: &Limits, way: f64, most: &Limits) -> Limits {
    Limits { speed: most.speed.min(limits.speed / way), acceleration: most.acceleration.min(limits.acceleration / way), jerk: most.jerk.min(limits.jerk / way) }
}

/// Computes the joint positions at the next point of a line from those at the previous one; `wish.goal` is used only to determine the
/// reason for a failure.
pub fn next(arm: &Arm, goal: &Pose, here: &[f64; JOINTS_MAX], wish: &Wish) -> Result<[f64; JOINTS_MAX], Obstacle> {
    let n = arm.joints();
    let found = inverse(arm, goal, &here[..n], wish.ranges, ON_THE_LINE);
    let leap = (0..n).any(|i| (found.q[i] - here[i]).abs() > LEAP);
    if found.reached && !leap {
        return Ok(found.q);
    }
    Err(obstacle(arm, goal, here, &found, wish))
}

/// Returns the obstacle: the end of a range or, if the goal itself can be reached, a singularity on the path to it.
fn obstacle(arm: &Arm, place: &Pose, here: &[f64; JOINTS_MAX], found: &InverseSolution, wish: &Wish) -> Obstacle {
    let n = arm.joints();
    if let Some(joint) = in_the_way(arm, place, &here[..n], found, ON_THE_LINE, 1) {
        return Obstacle::Limit(joint);
    }
    let end = inverse_anywhere(arm, &wish.goal, &found.q[..n], wish.ranges, ON_THE_LINE, ATTEMPTS);
    if end.reached {
        return Obstacle::Singular(0.0);
    }
    match in_the_way(arm, &wish.goal, &found.q[..n], &end, ON_THE_LINE, 1) {
        Some(joint) => Obstacle::Limit(joint),
        None => Obstacle::Unreachable(end.position_error),
    }
}
