// SPDX-License-Identifier: Apache-2.0
//! Shapes of moves: a line in joint space, or a course of the tool as spans of the joints.
//!
//! Inverse kinematics is solved at equidistant knots of a course. At a knot, the joints have the positions of the course, the slopes
//! given by the Jacobian, and the second derivative of the polynomials through the adjacent knots, so the spans between knots are
//! continuous up to the second derivative. The number of knots is doubled until the tool is also on its course between them.
use super::span::{Bounds, Joints, Place, Span};
use super::{Refusal, SPANS_OF_MOVE};
use crate::kinematics::JOINTS_MAX;
use crate::kinematics::chain::Arm;
use crate::kinematics::course::Course;
use crate::kinematics::inverse::{Ranges, damped};
use crate::kinematics::line::{self, Wish};
use crate::kinematics::pose::{Pose, add, cross, length, scale};
use crate::profile::Limits;

/// Distance of the tool from its course between two knots above which the number of knots is doubled, m and rad.
const TOLERANCE: f64 = 3e-7;
/// Minimum number of spans of a course, and the displacement and rotation of one span in the first attempt, m and rad.
const LEAST: usize = 4;
const WAY_OF_SPAN: f64 = 0.06;
const TURN_OF_SPAN: f64 = 0.3;
/// Displacement over which the joints' motion counts as linear; also the damping of the equation for it.
const SMALL: f64 = 1e-6;
const DAMPING: f64 = 1e-13;

/// Geometry of a move: spans of equal length, with a total length of 1.
pub struct Shape<'a> {
    pub spans: &'a mut [Span; SPANS_OF_MOVE],
    pub count: usize,
}

/// Joints at a knot: their positions, and their slopes along the course.
#[derive(Clone, Copy, Default)]
struct Knot {
    q: Joints,
    slope: Joints,
}

/// Request for a course of the tool.
#[derive(Clone, Copy, Debug)]
pub struct CourseWish<'a> {
    pub from: &'a Joints,
    pub course: &'a Course,
    /// Goal, used only to determine the reason for a refusal.
    pub goal: Pose,
    pub joints: &'a [Limits],
    pub ranges: Ranges<'a>,
}

impl Shape<'_> {
    /// Creates the straight line in joint space.
    pub fn line(&mut self, from: &Joints, to: &Joints) {
        self.spans[0] = Span::straight(from, to, 1.0);
        self.count = 1;
    }

    /// Creates the course of the tool.
    pub fn course(&mut self, arm: &Arm, wish: &CourseWish) -> Result<(), Refusal> {
        let (way, angle) = wish.course.lengths();
        let bend = length(wish.course.bend);
        let first = (way / WAY_OF_SPAN).max((angle + bend + wish.course.angle) / TURN_OF_SPAN).ceil();
        let mut count = LEAST.max(first as usize).min(SPANS_OF_MOVE);
        loop {
            self.follow(arm, wish, count)?;
            match self.check(arm, wish) {
                Ok(()) => return Ok(()),
                Err(refusal) if count == SPANS_OF_MOVE => return Err(refusal),
                Err(_) => count = (2 * count).min(SPANS_OF_MOVE),
            }
        }
    }

    /// Solves the inverse kinematics at `count` equal steps along the course.
    fn follow(&mut self, arm: &Arm, wish: &CourseWish, count: usize) -> Result<(), Refusal> {
        let start = arm.posture(&wish.from[..arm.joints()]).tool;
        let step = 1.0 / count as f64;
        let is_redundant = (0..arm.joints()).filter(|i| arm.moves(*i)).count() > 6;
        let mut knots = [Knot::default(); SPANS_OF_MOVE + 1];
        knots[0] = Knot { q: *wish.from, slope: slope(arm, wish.course, wish.from, 0.0) };
        for k in 1..=count {
            let s = k as f64 * step;
            let here = knots[k - 1];
            let before = if k > 1 { knots[k - 2].slope } else { here.slope };
            let ahead = |by: &dyn Fn(usize) -> f64| -> Joints { std::array::from_fn(|i| here.q[i] + step * by(i)) };
            let first = solved(arm, wish, &start, s, &ahead(&|i| 1.5 * here.slope[i] - 0.5 * before[i]))?;
            knots[k] = if is_redundant {
                // The motion that leaves the tool where it is follows the slopes, too.
                solved(arm, wish, &start, s, &ahead(&|i| 0.5 * (here.slope[i] + first.slope[i])))?
            } else {
                first
            };
        }
        let place = |k: usize| Place { q: knots[k].q, first: knots[k].slope, second: second(&knots[..=count], k, step) };
        for k in 0..count {
            self.spans[k] = Span::between(&place(k), &place(k + 1), step);
        }
        self.count = count;
        Ok(())
    }

    /// Checks that the tool is on its course in the middle of each span, and that the joints are within their ranges everywhere.
    fn check(&self, arm: &Arm, wish: &CourseWish) -> Result<(), Refusal> {
        let n = arm.joints();
        let start = arm.posture(&wish.from[..n]).tool;
        for (k, span) in self.spans[..self.count].iter().enumerate() {
            let s = (k as f64 + 0.5) / self.count as f64;
            let (off, turned) = arm.posture(&span.at(span.length / 2.0, n).q[..n]).tool.to(&wish.course.at(&start, s));
            if length(off) > TOLERANCE || length(turned) > TOLERANCE {
                return Err(Refusal::Singular(0.0));
            }
            let leaves = |i: &usize| {
                let (low, high) = span.range(*i);
                low < wish.ranges.min[*i].min(wish.from[*i]) || high > wish.ranges.max[*i].max(wish.from[*i])
            };
            if let Some(joint) = (0..n).find(leaves) {
                return Err(Refusal::Limit(joint as i32));
            }
        }
        Ok(())
    }

    /// Returns bounds of the derivatives of the whole shape.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::default();
        for span in &self.spans[..self.count] {
            bounds.include(&span.bounds());
        }
        bounds
    }

    /// Sets the length of the shape in the path coordinate.
    pub fn stretch(&mut self, length: f64) {
        let each = length / self.count as f64;
        self.spans[..self.count].iter_mut().for_each(|span| span.length = each);
    }
}

/// Returns the displacement of each joint per unit of the course.
fn slope(arm: &Arm, course: &Course, q: &Joints, s: f64) -> Joints {
    let n = arm.joints();
    let twist = twist(course, s).map(|x| x * SMALL);
    damped(&arm.jacobian(&arm.posture(&q[..n]))[..n], &twist, DAMPING).map(|slope| slope / SMALL)
}

/// Returns the linear and angular velocity of the tool on a course at s.
fn twist(course: &Course, s: f64) -> [f64; 6] {
    let (sine, cosine) = (course.angle * s).sin_cos();
    let linear = add(scale(course.along, cosine), scale(course.across, sine));
    let turn = add(scale(course.turn, s), scale(course.bend, s * s));
    let rate = add(course.turn, scale(course.bend, 2.0 * s));
    // The angular velocity of a rotation vector that changes.
    let angle = length(turn);
    let (a, b) = if angle < 1e-4 { (0.5, 1.0 / 6.0) } else { ((1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / (angle * angle * angle)) };
    let across = cross(turn, rate);
    let angular = add(rate, add(scale(across, a), scale(cross(turn, across), b)));
    [linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]]
}

/// Computes a knot from nearby joint positions.
fn solved(arm: &Arm, wish: &CourseWish, start: &Pose, s: f64, near: &Joints) -> Result<Knot, Refusal> {
    let place = wish.course.at(start, s);
    let goal = if wish.course.is_bent() { place } else { wish.goal };
    let limits = Limits { speed: 1.0, acceleration: 1.0, jerk: 1.0 };
    let asked = Wish { from: wish.from, goal, linear: limits, angular: limits, joints: wish.joints, ranges: wish.ranges, slowest: 0.0 };
    // The search begins within the ranges, which it keeps.
    let inside: Joints = std::array::from_fn(|i| match (wish.ranges.min.get(i), wish.ranges.max.get(i)) {
        (Some(min), Some(max)) => near[i].max(min.min(wish.from[i])).min(max.max(wish.from[i])),
        _ => near[i],
    });
    let q = line::next(arm, &place, &inside, &asked)?;
    Ok(Knot { q, slope: slope(arm, wish.course, &q, s) })
}

/// Returns the second derivative of the joints at a knot: that of the fourth-order polynomial through it and the adjacent knots.
fn second(knots: &[Knot], k: usize, step: f64) -> Joints {
    let last = knots.len() - 1;
    let square = step * step;
    std::array::from_fn(|i| {
        let at = |k: usize| (knots[k].q[i], knots[k].slope[i]);
        if k == 0 || k == last {
            let [(p, v), (q, w), (r, x)] = if k == 0 { [at(0), at(1), at(2)] } else { [at(last), at(last - 1), at(last - 2)] };
            let sign = if k == 0 { 1.0 } else { -1.0 };
            return (16.0 * (q - p) + 7.0 * (r - p)) / (2.0 * square) - sign * (6.0 * v + 8.0 * w + x) / step;
        }
        let [(p, v), (q, _), (r, x)] = [at(k - 1), at(k), at(k + 1)];
        2.0 * ((r - q) - (q - p)) / square - (x - v) / (2.0 * step)
    })
}

const _: () = assert!(SPANS_OF_MOVE >= 2 * LEAST && JOINTS_MAX == crate::profile::JOINTS_MAX);
