// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::BAD_CHAIN;
use crate::kinematics::chain::Chain;
use crate::kinematics::follower::{FollowerInputs, Follower, check};
use crate::kinematics::polyline::LongPolyline;
use crate::kinematics::polyline::generator::polyline_generator;
use crate::path::BEING_PLANNED;
use crate::takeover::Brake;
use opengpac::{Condition, ConditionOf, FunctionBlock, InPlace, Invocation, Outcome, Step};

polyline_generator! {
    /// Polyline generator for up to 4,096 poses: setpoint = q with forward(q) = pose(τ) of a planned path of the tool, like
    /// `polyline_generator`.
    ///
    /// It reads the path of a `long_polyline_planner` in place. During planning, the set-point is `start`, so that the joints do not
    /// move; `holding` then reports `held` immediately. Otherwise it behaves like `polyline_generator`. Faults: 1 the arm is not a chain
    /// of n joints, or the path was planned for a different number of joints; 3 an override is not between 0 and 1; 4 there is no path.
    LongPolylineGenerator,
    #[input(asynchronous, in_place)]
    path: InPlace<LongPolyline>
}
