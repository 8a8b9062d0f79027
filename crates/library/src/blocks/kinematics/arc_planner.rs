// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::course::{Arc, Course, Orientation};
use crate::kinematics::inverse::Ranges;
use crate::kinematics::line::planner::line_planner;
use crate::kinematics::line::{Line, Wish, plan_line};
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_LIMIT, BAD_POSE};
use crate::profile::{Limits, duration_s};
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::PI;

line_planner! {
    /// Arc planner: an arc of the tool on the circle through three poses, position(s) = start + along s sin(φ)/φ + across s (1 - cos
    /// φ)/φ, φ = angle s, s jerk-limited from 0 to 1.
    ///
    /// Execute it once; a `line_generator` bound to its line executes the motion, with the same time law as for a straight line. The arc
    /// begins at the current pose of the tool, passes `via` and ends at `goal`, or after `angle`, which may exceed a full circle. Three
    /// poses on a straight line give that line if `via` is between the others. The acceleration includes the centripetal acceleration, so
    /// a small circle is traversed more slowly. The orientation matches that of each of the three poses (0), turns evenly from the
    /// start's to the goal's (1), or is kept relative to the path (2). Before anything moves, inverse kinematics checks the whole arc, at
    /// 128 points for each half circle, as for a line. The motion is from rest to rest. If `waits` is true, the planner waits while the
    /// generator brakes any joints that are still moving. Faults: 1 the arm is not a chain of n joints; 2 a joint position is not finite,
    /// or the quaternion of a pose is not a unit quaternion; 3 a limit is not above 0, the angle is not between 0 and 4 π, or the
    /// orientation is not 0, 1 or 2.
    ArcPlanner {
        /// pose through which the tool passes on the arc: x y z in m, quaternion w x y z
        #[input(asynchronous, range = "[pose]")]
        via: [f64; 7],
        /// angle of the arc; 0: the arc ends at the goal
        #[input(asynchronous, default = 0.0, unit = "rad", range = "[0, 12.567]")]
        angle: f64,
        /// orientation along the arc: 0 matching each of the three poses, 1 turning evenly from the start's to the goal's, 2 kept
        /// relative to the path
        #[input(asynchronous, default = 0, range = "[0, 2]")]
        orientation: i32,
        /// the poses do not define an arc; the value is the reason: 1 via is at the start, 2 via is at the goal, 3 the goal is at the
        /// start, 4 the three are collinear and via is not between the other two, 5 the three are collinear and an angle is set, 6 the
        /// angle ends before via
        #[condition]
        no_arc: ConditionOf<i32>,
    }
}

/// Maximum angle, rad: two circles, with a margin for rounding.
const ANGLE_MAX: f64 = 12.567;
/// Rate at which the acceleration of the orientation may build up, 1/s.
const ANGULAR_ONSET: f64 = 10.0;

impl ArcPlanner {
    fn course(&mut self, start: &Pose, goal: &Pose) -> Result<Course, Option<u32>> {
        let via = Pose::of(&self.via).ok_or(Some(BAD_POSE))?;
        let orientation = Orientation::of(self.orientation).ok_or(Some(BAD_LIMIT))?;
        if !(0.0..=ANGLE_MAX).contains(&self.angle) {
            return Err(Some(BAD_LIMIT));
        }
        let angle = (self.angle > 0.0).then_some(self.angle);
        Course::arc(start, &Arc { via, goal: *goal, angle, orientation }).map_err(|reason| {
            self.no_arc.report(reason as i32);
            None
        })
    }

    fn angular_jerk(&self) -> f64 {
        ANGULAR_ONSET * self.angular_acceleration
    }
}

#[cfg(test)]
mod tests {
    use super::super::line_generator::tests::{JOINT, disturbed};
    use super::*;
    use crate::kinematics::JOINTS_MAX;
    use crate::kinematics::chain::samples::{HOME, six_joints};
    use crate::kinematics::pose::{cross, length, product, rotate, subtract, turn};
    use crate::path::samples::numbers;

    fn block(via: Pose, goal: Pose) -> ArcPlanner {
        let mut start = [0.0; JOINTS_MAX];
        start[..6].copy_from_slice(&HOME);
        ArcPlanner {
            n: 6, start, start_velocity: [0.0; 16], last_velocity: [0.0; 16], last_acceleration: [0.0; 16], last_time: [i64::MIN; 16],
            braking: [[0.0; 4]; 16], goal: goal.numbers(), speed: 0.25, angular_speed: 1.0, speed_max: [JOINT.speed; 16],
            acceleration_max: [JOINT.acceleration; 16], position_min: [-6.3; 16], position_max: [6.3; 16], line: <Line as opengpac::Type>::zero(),
            target: [0.0; 16], duration: 0.0, chain: six_joints(), acceleration: 1.0, jerk: 10.0, angular_acceleration: 5.0, slowest: 0.02, lead: 0.02,
            waits: false, unreachable: ConditionOf::new(0.0), limit: ConditionOf::new(0), singular: ConditionOf::new(0.0), has_planned: false,
            via: via.numbers(), angle: 0.0, orientation: 0, no_arc: ConditionOf::new(0),
        }
    }

    /// Returns a pose translated from the home pose of the tool and rotated about an axis.
    fn shifted(shift: [f64; 3], angle: f64) -> Pose {
        let chain = six_joints();
        let here = chain.read(6).expect("a chain").posture(&HOME).tool;
        Pose { position: std::array::from_fn(|i| here.position[i] + shift[i]), quaternion: product(turn([0.0, 0.6, 0.8], angle), here.quaternion) }
    }

    #[test]
    fn random_arcs_stay_on_their_circles_through_overrides_and_holds() {
        let mut gone = 0;
        for seed in 0..60 {
            let mut number = numbers(seed);
            let (centre, radius) = ([0.0; 3].map(|_: f64| number(-1.0, 1.0)), number(0.005, 0.1));
            let out = centre.map(|x| x * radius / length(centre));
            let aside = turn([0.0, 0.0, 1.0], number(0.3, 3.0));
            let place = |angle: f64| -> [f64; 3] { subtract(rotate(turn([0.6, 0.8, 0.0], angle), out), out) };
            let (via, goal) = (place(number(0.5, 2.0)), rotate(aside, place(number(2.5, 5.0))));
            let mut planner = block(shifted(via, number(-0.4, 0.4)), shifted(goal, number(-0.4, 0.4)));
            planner.orientation = (seed % 3) as i32;
            planner.angle = if seed % 4 == 1 { number(5.0, 9.0) } else { 0.0 };
            assert_eq!(planner.step(&Invocation::default()), Outcome::Done);
            if planner.line.plan == 0.0 {
                continue;
            }
            gone += 1;
            let poses = disturbed(planner.line, &mut number);
            let (a, b, c) = (shifted([0.0; 3], 0.0).position, shifted(via, 0.0).position, shifted(goal, 0.0).position);
            let normal = cross(subtract(b, a), subtract(c, a));
            let height = |p: [f64; 3]| (0..3).map(|i| (p[i] - a[i]) * normal[i]).sum::<f64>() / length(normal);
            let centre = middle(a, b, c);
            for pose in &poses {
                let off = length(subtract(pose.position, centre)) - length(subtract(a, centre));
                assert!(off.abs() < 1e-6 && height(pose.position).abs() < 1e-6, "{seed}: {off}");
            }
            let speeds: Vec<[f64; 3]> = poses.windows(2).map(|two| subtract(two[1].position, two[0].position).map(|x| x / 0.02)).collect();
            assert!(speeds.iter().all(|speed| length(*speed) <= 0.25 * (1.0 + 1e-6)), "{seed}");
            assert!(speeds.windows(2).all(|two| length(subtract(two[1], two[0])) / 0.02 <= 1.0 * 1.02), "{seed}: the tool's acceleration");
        }
        assert!(gone > 30, "{gone} of 60 can be gone");
    }

    /// Returns the centre of the circle through three points, from its barycentric weights.
    fn middle(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> [f64; 3] {
        let square = |u: [f64; 3], v: [f64; 3]| length(subtract(u, v)).powi(2);
        let (x, y, z) = (square(b, c), square(c, a), square(a, b));
        let weights = [x * (y + z - x), y * (z + x - y), z * (x + y - z)];
        let sum: f64 = weights.iter().sum();
        std::array::from_fn(|i| (weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i]) / sum)
    }

    #[test]
    fn what_is_no_arc_is_a_condition_and_leaves_no_line() {
        let mut planner = block(shifted([0.2, 0.0, 0.0], 0.0), shifted([0.1, 0.0, 0.0], 0.0));
        assert_eq!(planner.step(&Invocation::default()), Outcome::Done);
        assert!(planner.no_arc.is_reported() && planner.line.plan == 0.0);
        let mut far = block(shifted([0.0, -2.0, 0.0], 0.0), shifted([2.0, -2.0, 0.0], 0.0));
        assert_eq!(far.step(&Invocation::default()), Outcome::Done);
        assert!(far.unreachable.is_reported() && !far.no_arc.is_reported() && far.line.plan == 0.0);
        for (angle, orientation) in [(f64::NAN, 0), (-0.1, 0), (13.0, 0), (1.0, 3), (1.0, -1)] {
            let mut bad = ArcPlanner { angle, orientation, ..block(shifted([0.1, 0.1, 0.0], 0.0), shifted([0.2, 0.0, 0.0], 0.0)) };
            assert_eq!(bad.step(&Invocation::default()), Outcome::Fault(BAD_LIMIT));
        }
    }

    #[test]
    fn a_joint_that_would_leave_its_range_on_the_way_is_named() {
        // Both ends are within the range of the elbow, but the path between them is not.
        let (via, goal) = (shifted([0.08, 0.0, -0.08], 0.0), shifted([0.01, 0.0, -0.02], 0.0));
        let mut free = block(via, goal);
        assert_eq!((free.step(&Invocation::default()), free.line.plan), (Outcome::Done, 1.0));
        let end = free.line.to[2];
        let mut held = block(via, goal);
        held.position_max[2] = end.max(HOME[2]) + 0.05;
        assert_eq!(held.step(&Invocation::default()), Outcome::Done);
        assert!(held.limit.is_reported() && held.line.plan == 0.0, "the elbow ends at {end}");
    }
}
