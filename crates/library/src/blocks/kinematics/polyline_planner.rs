// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::inverse::Ranges;
use crate::kinematics::line::Wish;
use crate::kinematics::polyline::planner::polyline_planner;
use crate::kinematics::polyline::{Budget, Polyline, PolylinePlanning, which};
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_LIMIT, BAD_POSE};
use crate::path::{BLEND_SHARES, POINTS_MAX, Passing};
use crate::profile::Limits;
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::PI;

polyline_planner! {
    /// Polyline planner: straight lines of the tool through poses, position = pₖ + u (…), joined by parabolic blends of acceleration (u₂
    /// - u₁) w²/(2 d).
    ///
    /// Execute it once; a `polyline_generator` bound to its path executes the motion. Each pose has a maximum distance at which the tool
    /// may pass it (`blend`, 0: the tool stops there) and a maximum speed on the line to it; the orientation turns evenly between poses.
    /// Before anything moves, inverse kinematics checks the whole path, at 512 points: if it leaves a joint's range or the reach of the
    /// arm, or comes too close to a singularity, no path is output, a condition is reported, and `refused` is the pose at the end of that
    /// line. The path is slowed down as a whole until no joint exceeds its limits. Consecutive equal poses count once, so a list can be
    /// padded by repeating its last pose. Planning takes some milliseconds, so use a slow source. It allocates nothing. The motion is
    /// from rest to rest. If `waits` is true, the planner waits while the generator brakes any joints that are still moving. Faults: 1
    /// the arm is not a chain of n joints; 2 a joint position is not finite, or the quaternion of a pose is not a unit quaternion; 3 a
    /// limit is not above 0 or a blend is below 0.
    PolylinePlanner, at_once: Budget { steps: usize::MAX, samples: usize::MAX }, shares: BLEND_SHARES,
    #[input(asynchronous, range = "[pose]")]
    poses: [[f64; 7]; POINTS_MAX],
    #[input(asynchronous, default = [0.0; POINTS_MAX], unit = "m", range = "[0, 10]")]
    blend,
    #[input(asynchronous, default = [0.25; POINTS_MAX], unit = "m/s", range = "(0, 10]")]
    speed: [f64; POINTS_MAX],
    #[output]
    path: Polyline
}
