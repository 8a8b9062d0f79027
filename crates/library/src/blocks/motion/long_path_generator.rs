// SPDX-License-Identifier: Apache-2.0
use crate::pace;
use crate::path::generator::{BAD_OVERRIDE, NO_PLAN, OTHER_SIZE, PLACES, path_generator};
use crate::path::{BEING_PLANNED, LongPath};
use crate::span::Span;
use crate::takeover::{Brake, Tail};
use opengpac::{Condition, ConditionOf, FunctionBlock, InPlace, Invocation, Outcome, Step};

path_generator! {
    /// Path generator for up to 4,096 way-points: setpoint = q(τ) of a planned path, like `path_generator`.
    ///
    /// It reads the path of a `long_path_planner` in place. During planning, the set-point is `start`, so that the joints do not move;
    /// `holding` then reports `held` immediately. Otherwise it behaves like `path_generator`. Faults: 1 there is no path; 2 it was
    /// planned for a different number of joints; 3 an override is not between 0 and 1.
    LongPathGenerator,
    #[input(asynchronous, in_place)]
    path: InPlace<LongPath>
}
