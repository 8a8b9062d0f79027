// SPDX-License-Identifier: Apache-2.0
//! A move that has not been appended yet, and the arm that executes it.
use super::span::{Bounds, Joints};
use crate::kinematics::chain::Arm;
use crate::kinematics::inverse::Ranges;
use crate::profile::Limits;

/// Arm that follows a path, and the limits of its joints. Slices have one element per joint.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    pub arm: &'a Arm<'a>,
    pub joints: &'a [Limits],
    pub ranges: Ranges<'a>,
}

/// A move that has not been appended yet. Its shape is stored in the draft of the path.
pub(super) struct Draft {
    pub count: usize,
    pub bounds: Bounds,
    /// Length of the move in the path coordinate, and length of 1 m of a course in it (`scale`).
    pub length: f64,
    pub scale: f64,
    pub limits: Limits,
    /// Requested maximum speed of the path coordinate.
    pub speed: f64,
    pub acceleration: Joints,
    /// Angle by which the tool turns, rad.
    pub turn: f64,
}

impl Draft {
    /// Converts a distance to a length in the path coordinate. The units are 0 fraction of the move, 1 rad of the joint that moves
    /// furthest, 2 m of the tool, 3 rad of its orientation; in unit 3, the result is at most half of the move.
    pub fn reach(&self, distance: f64, unit: i64) -> f64 {
        match unit {
            0 => distance * self.length,
            1 => distance / self.bounds.of.iter().fold(0.0, |most: f64, of| most.max(of[0])),
            3 if distance > 0.0 => self.length * (distance / self.turn).min(0.5),
            3 => 0.0,
            _ => distance * self.scale,
        }
    }
}
