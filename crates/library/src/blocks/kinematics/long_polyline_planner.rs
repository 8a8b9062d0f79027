// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::inverse::Ranges;
use crate::kinematics::line::Wish;
use crate::kinematics::polyline::planner::polyline_planner;
use crate::kinematics::polyline::{Budget, LongPolyline, PolylinePlanning, which};
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_LIMIT, BAD_POSE};
use crate::path::{LONG_BLEND_SHARES, LONG_POINTS_MAX, Passing};
use crate::profile::Limits;
use opengpac::{ConditionOf, FunctionBlock, InPlace, InPlaceMut, Invocation, Outcome, Step};
use std::f64::consts::PI;

/// Work done in one invocation: no more points than a `polyline_planner` checks in total.
const AT_ONCE: Budget = Budget { steps: 2048, samples: 512 };

polyline_planner! {
    /// Polyline planner for up to 4,096 poses: position = pₖ + u (…), like `polyline_planner`.
    ///
    /// Activate it together with a `long_polyline_generator` bound to its path: the planner plans some poses in each invocation, and the
    /// generator holds the joints until the path is ready. Inverse kinematics checks the path at 512 points, or at two points per pose if
    /// that is more; each invocation checks 512 of them. This takes some milliseconds, so use a slow source. A blend takes up to a
    /// quarter of a line, instead of half as in `polyline_planner`. Otherwise it behaves like `polyline_planner`. The tables of poses,
    /// blends and speeds are read in place, so they have no defaults and must not change until the path is ready. Faults: 1 the arm is
    /// not a chain of n joints; 2 a joint position is not finite, or the quaternion of a pose is not a unit quaternion; 3 a limit is not
    /// above 0 or a blend is below 0.
    LongPolylinePlanner, at_once: AT_ONCE, shares: LONG_BLEND_SHARES,
    #[input(asynchronous, in_place, range = "[pose]")]
    poses: InPlace<[[f64; 7]; LONG_POINTS_MAX]>,
    #[input(asynchronous, in_place, unit = "m", range = "[0, 10]")]
    blend,
    #[input(asynchronous, in_place, unit = "m/s", range = "(0, 10]")]
    speed: InPlace<[f64; LONG_POINTS_MAX]>,
    #[output(in_place)]
    path: InPlaceMut<LongPolyline>
}
