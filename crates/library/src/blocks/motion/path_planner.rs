// SPDX-License-Identifier: Apache-2.0
use crate::path::planner::{BAD_LIMIT, NOT_FINITE, path_planner};
use crate::path::{BLEND_SHARES, POINTS_MAX, Passing, Path, Planning};
use crate::profile::Limits;
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::PI;

path_planner! {
    /// Path planner: straight lines in joint space through way-points, q(τ) = qₖ + u (…), joined by parabolic blends of acceleration (u₂
    /// - u₁) w²/(2 d).
    ///
    /// Execute it once; a `path_generator` bound to its path executes the motion. Each way-point has a maximum distance at which a joint
    /// may pass it (`blend`, 0: the arm stops there) and a maximum speed of the fastest joint on the line to it. Every joint stays within
    /// its speed and acceleration limits everywhere; the last way-point is reached exactly. Consecutive equal way-points count once, so a
    /// list can be padded by repeating its last way-point. Source: Craig, *Introduction to Robotics*, section 7.4. The motion is from
    /// rest to rest; the planner allocates nothing. If `waits` is true, the planner waits while the generator brakes any joints that are
    /// still moving. Faults: 1 a number is not finite or a blend is below 0; 2 a limit is not above 0.
    PathPlanner, at_once: usize::MAX, shares: BLEND_SHARES,
    #[input(asynchronous)]
    points: [[f64; 16]; POINTS_MAX],
    #[input(asynchronous, default = [0.0; POINTS_MAX], unit = "rad|m", range = "[0, 100]")]
    blend,
    #[input(asynchronous, default = [0.5; POINTS_MAX], unit = "rad/s|m/s", range = "(0, 100]")]
    speed: [f64; POINTS_MAX],
    #[output]
    path: Path
}
