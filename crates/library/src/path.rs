// SPDX-License-Identifier: Apache-2.0
//! Motion of several joints through way-points: straight lines in joint space, joined by parabolic blends.
//!
//! At a way-point, the corner is cut by a parabola that begins and ends at the distance d from it. At the constant rate w along it, each
//! joint has a constant acceleration (u₂ - u₁) w²/(2 d), where u₁ and u₂ are the directions of the lines, and the path passes the
//! way-point at d/4 |u₂ - u₁| (Craig, *Introduction to Robotics*, section 7.4: linear paths with parabolic blends). Along a line, the
//! rate increases, is constant and decreases. The rates at the blends are the maximum that every joint's limits and the lines between
//! them allow; they are computed in one forward and one backward pass. Thus no limit is exceeded anywhere, and the last way-point is
//! reached exactly.
//!
//! [`planning`] creates a path, in portions if it is long; generators read it through a [`View`].
pub(crate) mod generator;
pub(crate) mod planner;
pub mod planning;
mod tables;
mod view;

pub use planning::{BLEND_SHARES, LONG_BLEND_SHARES, Planning, Table};
pub use tables::{LongPath, Path};
pub use view::{Part, View};

/// Maximum number of way-points of one motion, excluding its start.
pub const POINTS_MAX: usize = 64;
/// Maximum number of way-points of a long path.
pub const LONG_POINTS_MAX: usize = 4096;
/// Distance in every joint below which way-points count as coincident, rad or m.
const SAME: f64 = 1e-12;

/// Value of [`Path::plan`] while a path is being planned over several invocations.
pub const BEING_PLANNED: f64 = -1.0;

/// Distance at which the path passes a way-point, and speed on the line to it.
#[derive(Clone, Copy, Debug)]
pub struct Passing {
    /// Maximum distance of a joint from the way-point, rad or m; 0: the joints stop there.
    pub blend: f64,
    /// Maximum speed of a joint on the line to the way-point, rad/s or m/s.
    pub speed: f64,
}

#[cfg(test)]
pub mod samples {
    use super::*;
    use crate::profile::{JOINTS_MAX, Limits};

    /// Plans path number `plan` in a single call.
    pub fn plan(plan: f64, start: &[f64], points: &[[f64; JOINTS_MAX]], passing: &[Passing], limits: &[Limits]) -> Path {
        let mut path = <Path as opengpac::Type>::zero();
        assert_eq!(plan_by(usize::MAX, &mut path.table(), start, points, passing, limits), 1);
        path.plan = plan;
        path
    }

    /// Plans a path, a number of steps at a time. Returns the number of calls.
    pub fn plan_by(steps: usize, table: &mut Table, start: &[f64], points: &[[f64; JOINTS_MAX]], passing: &[Passing], limits: &[Limits]) -> usize {
        let shares = if points.len() > POINTS_MAX { LONG_BLEND_SHARES } else { BLEND_SHARES };
        let mut planning = Planning::begin(table, 0, start, shares);
        points.iter().zip(passing).for_each(|(point, passing)| table.add(point, *passing));
        (1..).find(|_| planning.advance(table, limits, &mut { steps })).expect("it ends")
    }

    /// Numbers from a small deterministic generator, so that every run checks the same cases.
    pub fn numbers(seed: u64) -> impl FnMut(f64, f64) -> f64 {
        let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move |low, high| {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            low + (high - low) * ((x >> 11) as f64 / (1u64 << 53) as f64)
        }
    }

    /// A random path with some stops, some close points and some duplicates.
    pub struct Case {
        pub n: usize,
        pub start: Vec<f64>,
        pub points: Vec<[f64; JOINTS_MAX]>,
        pub passing: Vec<Passing>,
        pub limits: Vec<Limits>,
    }

    pub fn case(seed: u64) -> Case {
        let mut number = numbers(seed);
        let n = 1 + seed as usize % JOINTS_MAX;
        let count = 1 + seed as usize % 9;
        let start: Vec<f64> = (0..n).map(|_| number(-2.0, 2.0)).collect();
        let mut points: Vec<[f64; JOINTS_MAX]> = (0..count).map(|_| std::array::from_fn(|i| if i < n { number(-2.0, 2.0) } else { 0.0 })).collect();
        if seed.is_multiple_of(3) && count > 1 {
            points[count - 2] = points[count - 1];
        }
        if seed.is_multiple_of(5) {
            points[0][..n].copy_from_slice(&start);
        }
        let passing = (0..count).map(|k| Passing { blend: if k % 4 == 3 { 0.0 } else { number(0.0, 0.3) }, speed: number(0.1, 2.0) }).collect();
        let limits = (0..n).map(|_| Limits { speed: number(0.3, 3.0), acceleration: number(0.5, 10.0), jerk: 1.0 }).collect();
        Case { n, start, points, passing, limits }
    }
}

#[cfg(test)]
mod tests;
