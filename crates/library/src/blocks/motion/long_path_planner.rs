// SPDX-License-Identifier: Apache-2.0
use crate::path::planner::{BAD_LIMIT, NOT_FINITE, path_planner};
use crate::path::{LONG_BLEND_SHARES, LONG_POINTS_MAX, LongPath, Passing, Planning};
use crate::profile::Limits;
use opengpac::{ConditionOf, FunctionBlock, InPlace, InPlaceMut, Invocation, Outcome, Step};
use std::f64::consts::PI;

/// Number of way-point steps planned in one invocation, which takes at least a tenth of a millisecond.
const AT_ONCE: usize = 2048;

path_planner! {
    /// Path planner for up to 4,096 way-points: q(τ) = qₖ + u (…), like `path_planner`.
    ///
    /// Activate it together with a `long_path_generator` bound to its path: the planner plans some way-points in each invocation, so that
    /// no invocation takes long, and the generator holds the joints until the path is ready; a path of 4,096 way-points is ready at the
    /// tenth invocation. A blend takes up to a quarter of a line, instead of half as in `path_planner`, so that the speed can rise and
    /// fall between way-points that are close together. Otherwise it behaves like `path_planner`. The tables of way-points, blends and
    /// speeds are read in place, so they have no defaults and must not change until the path is ready. With `waits`, it plans only once
    /// per start. Faults: 1 a number is not finite or a blend is below 0; 2 a limit is not above 0.
    LongPathPlanner, at_once: AT_ONCE, shares: LONG_BLEND_SHARES,
    #[input(asynchronous, in_place)]
    points: InPlace<[[f64; 16]; LONG_POINTS_MAX]>,
    #[input(asynchronous, in_place, unit = "rad|m", range = "[0, 100]")]
    blend,
    #[input(asynchronous, in_place, unit = "rad/s|m/s", range = "(0, 100]")]
    speed: InPlace<[f64; LONG_POINTS_MAX]>,
    #[output(in_place)]
    path: InPlaceMut<LongPath>
}
