// SPDX-License-Identifier: Apache-2.0
//! Motion of the tool along a direction without a known end: speed, stop and new directions are set during the motion.
//!
//! Before each set-point, the stop that would follow it is computed, set-point by set-point, by inverse kinematics. If every joint stays
//! within its range, speed, acceleration and jerk until rest, the set-point is accepted and its stop is stored; otherwise the arm
//! continues along the last stored stop, and a lower speed is tried. Thus there is always a path to rest along the line within the limits
//! of the joints, even near singularities and the ends of ranges (Fraichard and Asama, *Inevitable collision states*, 2004: a state is
//! safe if a checked manoeuvre leads from it to rest).
use super::JOINTS_MAX;
use super::chain::Arm;
use super::inverse::{Ranges, damped, inverse};
use super::line::ON_THE_LINE;
use super::pose::{Pose, length, rotate, scale};
use crate::online::{Profile, State, towards};
use crate::profile::Limits;

/// Maximum number of set-points of a stop.
const STOP_MAX: usize = 32;
/// Factor by which the speed is reduced if its stop is infeasible, and by which it is increased again.
const LOWER: f64 = 0.7;
const HIGHER: f64 = 1.05;
/// Fraction of the requested speed below which the direction is abandoned.
const SLOWEST: f64 = 0.02;
/// Fraction of a joint's acceleration and jerk that the tool's acceleration and jerk may use; the rest is for the curvature in joint
/// space.
const SHARE: f64 = 0.6;
/// Fraction by which rounding may exceed a limit.
const ROUNDING: f64 = 1e-6;
/// Number of equal set-points that counts as rest.
const REST: u32 = 3;
/// Displacement of the tool, m or rad, over which the joints' motion counts as linear; also the damping of the equation for it.
const SMALL: f64 = 1e-6;
const DAMPING: f64 = 1e-12;
/// Displacement of a joint per unit displacement of the tool above which the tool does not come any closer to a singularity, rad or m for
/// 1 m or 1 rad.
const SLOPE_MAX: f64 = 2e3;
const ANYWHERE: Ranges = Ranges { min: &[f64::NEG_INFINITY; JOINTS_MAX], max: &[f64::INFINITY; JOINTS_MAX] };

/// Velocity of the tool, m/s and rad/s, in the frame of the arm's base or of the tool.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    pub linear: [f64; 3],
    pub angular: [f64; 3],
    pub in_tool: bool,
}

/// Inputs of one set-point. The slices have one element per joint.
#[derive(Clone, Copy, Debug)]
pub struct Wish<'a> {
    pub twist: Twist,
    /// Distance to move in this direction, m, or rad if the tool only rotates.
    pub distance: f64,
    /// Permitted fraction of the speed, 0 to 1.
    pub share: f64,
    /// Acceleration and jerk: of the tool's position, m/s² and m/s³, and of its orientation.
    pub linear: Limits,
    pub angular: Limits,
    pub joints: &'a [Limits],
    pub ranges: Ranges<'a>,
    /// Time between two set-points, s.
    pub cycle_s: f64,
}

/// Reason why the tool cannot continue in a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// The range of this joint (numbered from 0) ends.
    Limit(usize),
    /// The arm comes close to a singularity or to the limit of its reach.
    Singular,
}

/// Direction of a motion from its starting pose.
#[derive(Clone, Copy, Debug)]
struct Heading {
    start: Pose,
    /// Displacement and rotation of the tool for one unit along the direction, in the frame of the poses.
    linear: [f64; 3],
    angular: [f64; 3],
    /// Direction as first requested, with which later requests are compared.
    unit: Twist,
    distance: f64,
}

/// A checked sequence of set-points that ends at rest.
#[derive(Clone, Copy, Debug)]
struct Stop {
    q: [[f64; JOINTS_MAX]; STOP_MAX],
    way: [State; STOP_MAX],
    count: usize,
    /// Index of the next set-point.
    next: usize,
}

/// Motion of a tool along a direction.
#[derive(Clone, Copy, Debug)]
pub struct ToolJog {
    /// Last set-points, newest first.
    q: [[f64; JOINTS_MAX]; 3],
    /// Position and speed along the direction, m or rad.
    way: State,
    heading: Option<Heading>,
    /// Speed along the direction to try next.
    speed: f64,
    stop: Stop,
    /// Reason why the direction was abandoned.
    obstacle: Option<Obstacle>,
    /// Number of consecutive equal set-points.
    rest: u32,
}

impl Default for ToolJog {
    fn default() -> ToolJog {
        let stop = Stop { q: [[0.0; JOINTS_MAX]; STOP_MAX], way: [State::default(); STOP_MAX], count: 0, next: 0 };
        ToolJog { q: [[0.0; JOINTS_MAX]; 3], way: State::default(), heading: None, speed: 0.0, stop, obstacle: None, rest: 0 }
    }
}

impl Twist {
    /// Returns the speed: m/s, or rad/s if the tool only rotates.
    pub fn speed(&self) -> f64 {
        let linear = length(self.linear);
        if linear > 0.0 { linear } else { length(self.angular) }
    }

    /// Returns the direction as a twist of unit speed; `None` at rest.
    fn unit(&self) -> Option<Twist> {
        let speed = self.speed();
        (speed > 0.0).then(|| Twist { linear: scale(self.linear, 1.0 / speed), angular: scale(self.angular, 1.0 / speed), ..*self })
    }

    /// Returns true if both move the tool in the same direction, at any speed.
    fn is_along(&self, other: &Twist) -> bool {
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9);
        self.in_tool == other.in_tool && near(self.linear, other.linear) && near(self.angular, other.angular)
    }
}

impl ToolJog {
    /// Starts the motion at rest at these joint positions.
    pub fn begin(&mut self, q: &[f64; JOINTS_MAX]) {
        *self = ToolJog { q: [*q; 3], rest: REST, ..ToolJog::default() };
    }

    /// Returns the set-point of each joint.
    pub fn setpoint(&self) -> &[f64; JOINTS_MAX] {
        &self.q[0]
    }

    /// Returns true if the joints are at rest and their servos have caught up.
    pub fn is_at_rest(&self) -> bool {
        self.rest >= REST
    }

    /// Returns the reason why the tool is at rest although motion is requested.
    pub fn obstacle(&self) -> Option<Obstacle> {
        self.obstacle.filter(|_| self.is_at_rest())
    }

    /// Returns true if the tool is at rest at the end of the requested distance.
    pub fn has_arrived(&self) -> bool {
        self.is_at_rest() && self.heading.is_some_and(|heading| self.way.position == heading.distance)
    }

    /// Computes the next set-point.
    pub fn advance(&mut self, arm: &Arm, wish: &Wish) {
        self.turn_to(arm, wish);
        let Some(heading) = self.heading else { return self.keep(self.q[0], State::default()) };
        let goes_on = wish.twist.unit().is_some_and(|unit| unit.is_along(&heading.unit)) && self.obstacle.is_none();
        let wanted = if goes_on { wish.twist.speed() * wish.share } else { 0.0 };
        self.speed = if self.way.is_at_rest() && self.rest >= REST && self.speed == 0.0 { wanted } else { (self.speed * HIGHER).min(wanted) };
        let slopes = slopes(arm, &heading, &self.q[0]);
        let limits = along(wish, &heading, &slopes);
        let way = if self.speed == 0.0 {
            towards(self.way, 0.0, limits, wish.cycle_s)
        } else if heading.distance.is_finite() {
            Profile::to(self.way, heading.distance, Limits { speed: self.speed, ..limits }).at(wish.cycle_s)
        } else {
            towards(self.way, self.speed, limits, wish.cycle_s)
        };
        match self.checked(arm, wish, &heading, way, limits, &slopes) {
            Ok(stop) => {
                self.stop = stop;
                self.follow();
            }
            Err(obstacle) => {
                self.follow();
                self.speed *= LOWER;
                if goes_on && wanted > 0.0 && self.speed < SLOWEST * wanted {
                    self.obstacle = Some(obstacle);
                }
            }
        }
    }

    /// Adopts the requested direction, if the joints are at rest.
    fn turn_to(&mut self, arm: &Arm, wish: &Wish) {
        if !self.is_at_rest() {
            return;
        }
        let unit = wish.twist.unit();
        let is_same = |heading: &Heading, unit: &Twist| heading.unit.is_along(unit) && heading.distance == wish.distance;
        if let (Some(heading), Some(unit)) = (&self.heading, &unit)
            && is_same(heading, unit)
        {
            return;
        }
        let start = arm.posture(&self.q[0][..arm.joints()]).tool;
        let frame = if wish.twist.in_tool { start.quaternion } else { arm.base().quaternion };
        self.heading =
            unit.map(|unit| Heading { start, linear: rotate(frame, unit.linear), angular: rotate(frame, unit.angular), unit, distance: wish.distance });
        (self.way, self.speed, self.obstacle, self.stop.count) = (State::default(), 0.0, None, 0);
    }

    /// Computes the set-points from a state along the direction to rest, within these limits along it; the error is the obstacle.
    /// `slopes` are the current slopes of the joints.
    fn checked(&self, arm: &Arm, wish: &Wish, heading: &Heading, way: State, limits: Limits, slopes: &[f64; JOINTS_MAX]) -> Result<Stop, Obstacle> {
        let profile = Profile::stop(way, limits);
        let count = 1 + (profile.duration_s() / wish.cycle_s).ceil() as usize;
        if count > STOP_MAX {
            return Err(Obstacle::Singular);
        }
        let mut stop = Stop { count, next: 0, ..self.stop };
        let mut last = self.q;
        for k in 0..count {
            let state = if k == 0 { way } else { profile.at(k as f64 * wish.cycle_s) };
            let pose = heading.start.along((heading.linear, heading.angular), state.position);
            (stop.q[k], stop.way[k]) = (solved(arm, wish, &pose, &last[0])?, state);
            check(wish, &stop.q[k], &last)?;
            last = [stop.q[k], last[0], last[1]];
        }
        // The joints stay at rest: the differences that end with the last step count too.
        for _ in 0..REST - 1 {
            check(wish, &last[0], &last)?;
            last = [last[0], last[0], last[1]];
        }
        check_approach(arm, wish, heading, slopes, &last[0])?;
        Ok(stop)
    }

    /// Takes the next set-point of the last checked stop, or stays in place at its end.
    fn follow(&mut self) {
        let Stop { next, count, .. } = self.stop;
        if next < count {
            self.stop.next += 1;
            self.keep(self.stop.q[next], self.stop.way[next]);
        } else {
            self.keep(self.q[0], State { position: self.way.position, ..State::default() });
        }
    }

    fn keep(&mut self, q: [f64; JOINTS_MAX], way: State) {
        self.rest = if q == self.q[0] && way.is_at_rest() { self.rest.saturating_add(1) } else { 0 };
        (self.q, self.way) = ([q, self.q[0], self.q[1]], way);
    }
}

/// Returns the acceleration and jerk along the direction: the minimum of those of the tool and those that the joints allow with these
/// slopes.
fn along(wish: &Wish, heading: &Heading, slopes: &[f64; JOINTS_MAX]) -> Limits {
    let (linear, angular) = (length(heading.linear), length(heading.angular));
    let part = |limit: f64, by: f64| if by > 0.0 { limit / by } else { f64::INFINITY };
    let mut limits = Limits {
        speed: f64::INFINITY,
        acceleration: part(wish.linear.acceleration, linear).min(part(wish.angular.acceleration, angular)),
        jerk: part(wish.linear.jerk, linear).min(part(wish.angular.jerk, angular)),
    };
    for (slope, joint) in slopes.iter().zip(wish.joints) {
        limits.acceleration = limits.acceleration.min(part(SHARE * joint.acceleration, *slope));
        limits.jerk = limits.jerk.min(part(SHARE * joint.jerk, *slope));
    }
    limits
}

/// Checks that a pose at rest is not too close to a singularity ahead, where the joints would move so far for a small displacement of the
/// tool that the direction is abandoned. Motion in the opposite direction, along which the slopes decrease, is always permitted.
fn check_approach(arm: &Arm, wish: &Wish, heading: &Heading, now: &[f64; JOINTS_MAX], rest: &[f64; JOINTS_MAX]) -> Result<(), Obstacle> {
    let slowest = SLOWEST * wish.twist.speed();
    let then = slopes(arm, heading, rest);
    let is_too_near = |i: usize, joint: &Limits| then[i] > now[i] && (then[i] > SLOPE_MAX || then[i] * slowest > joint.speed);
    if wish.joints.iter().enumerate().any(|(i, joint)| is_too_near(i, joint)) { Err(Obstacle::Singular) } else { Ok(()) }
}

/// Returns the displacement of each joint for a displacement of the tool of 1 m, or 1 rad, along the direction, with the joints at `q`.
fn slopes(arm: &Arm, heading: &Heading, q: &[f64; JOINTS_MAX]) -> [f64; JOINTS_MAX] {
    let posture = arm.posture(&q[..arm.joints()]);
    let error: [f64; 6] = std::array::from_fn(|i| if i < 3 { heading.linear[i] } else { heading.angular[i - 3] } * SMALL);
    damped(&arm.jacobian(&posture)[..arm.joints()], &error, DAMPING).map(|slope| slope.abs() / SMALL)
}

/// Computes the joint positions for a pose, close to the previous ones and within the ranges; a joint outside its range may return to it.
fn solved(arm: &Arm, wish: &Wish, pose: &Pose, before: &[f64; JOINTS_MAX]) -> Result<[f64; JOINTS_MAX], Obstacle> {
    let n = arm.joints();
    let found = inverse(arm, pose, &before[..n], ANYWHERE, ON_THE_LINE);
    if !found.reached {
        return Err(Obstacle::Singular);
    }
    let leaves = |i: &usize| found.q[*i] < wish.ranges.min[*i].min(before[*i]) || found.q[*i] > wish.ranges.max[*i].max(before[*i]);
    match (0..n).find(leaves) {
        Some(joint) => Err(Obstacle::Limit(joint)),
        None => Ok(found.q),
    }
}

/// Checks that the speed, acceleration and jerk from the last three set-points to this one are within the limits of each joint.
fn check(wish: &Wish, q: &[f64; JOINTS_MAX], last: &[[f64; JOINTS_MAX]; 3]) -> Result<(), Obstacle> {
    let t = wish.cycle_s;
    let is_within = |(i, limits): (usize, &Limits)| {
        let steps = [q[i] - last[0][i], last[0][i] - last[1][i], last[1][i] - last[2][i]];
        let (change, before) = (steps[0] - steps[1], steps[1] - steps[2]);
        let most = |limit: f64, span_s: f64| limit * span_s * (1.0 + ROUNDING);
        steps[0].abs() <= most(limits.speed, t) && change.abs() <= most(limits.acceleration, t * t) && (change - before).abs() <= most(limits.jerk, t * t * t)
    };
    if wish.joints.iter().enumerate().all(is_within) { Ok(()) } else { Err(Obstacle::Singular) }
}

#[cfg(test)]
mod tests;
