// SPDX-License-Identifier: Apache-2.0
use crate::pace;
use crate::path::generator::{BAD_OVERRIDE, NO_PLAN, OTHER_SIZE, PLACES, path_generator};
use crate::path::{BEING_PLANNED, LongPath};
use crate::span::Span;
use crate::takeover::{Brake, Tail};
use opengpac::{Condition, ConditionOf, FunctionBlock, InPlace, Invocation, Outcome, Step};

path_generator! {
    /// Path generator for up to 4,096 way-points: setpoint = q(τ) of a planned path, as `path_generator`.
    ///
    /// It takes the path of a `long_path_planner`, which it reads where it lies. While that is being planned the set-point is `start`, so that the joints
    /// stay where they are; `holding` then reports `held` at once. All else is as of `path_generator`.
    /// Faults: 1 there is no path; 2 it is planned for another number of joints; 3 an override is not within 0 and 1.
    LongPathGenerator,
    #[input(asynchronous, in_place)]
    path: InPlace<LongPath>
}
