// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::course::Course;
use crate::kinematics::inverse::Ranges;
use crate::kinematics::line::planner::line_planner;
use crate::kinematics::line::{Line, Wish, plan_line};
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_LIMIT, BAD_POSE};
use crate::profile::{Limits, duration_s};
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::PI;

line_planner! {
    /// Line planner: a straight line of the tool, pose(s) = (start + s (goal - start), start turned by s of the angle), s jerk-limited
    /// from 0 to 1.
    ///
    /// Execute it once; a `line_generator` bound to its line executes the motion. Before anything moves, inverse kinematics checks the
    /// whole line, at 128 points: if it leaves a joint's range or the reach of the arm, or comes too close to a singularity, no line is
    /// output, and a condition is reported. The speed is the requested one, or the maximum that the joints can follow at the most
    /// demanding point. Planning takes about a millisecond, and allocates nothing. The motion is from rest to rest. If `waits` is true,
    /// the planner waits while the generator brakes any joints that are still moving. Faults: 1 the arm is not a chain of n joints; 2 a
    /// joint position is not finite, or the quaternion of the goal is not a unit quaternion; 3 a limit is not above 0.
    LinePlanner {
        /// maximum jerk of the orientation
        #[param(default = 50.0, range = "(0, 1000000]")]
        angular_jerk: f64,
    }
}

impl LinePlanner {
    fn course(&self, start: &Pose, goal: &Pose) -> Result<Course, Option<u32>> {
        Ok(Course::straight(start, goal))
    }

    fn angular_jerk(&self) -> f64 {
        self.angular_jerk
    }
}
