// SPDX-License-Identifier: Apache-2.0
//! A move before it is appended, and the arm for which it is.
use super::span::{Bounds, Joints};
use crate::kinematics::chain::Arm;
use crate::kinematics::inverse::Ranges;
use crate::profile::Limits;

/// The arm of a path. Slices have one element per joint.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    pub arm: &'a Arm<'a>,
    pub joints: &'a [Limits],
    pub ranges: Ranges<'a>,
}

/// A move before it is appended: its shape is the draft of the path.
pub(super) struct Draft {
    pub count: usize,
    pub bounds: Bounds,
    /// Length in the path coordinate, and that of 1 m of a course.
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
    /// Returns the length in the path coordinate of a distance in a unit: 0 share of the way, 1 rad of the joint that moves furthest, 2 m
    /// of the tool, 3 rad of its orientation; a move that turns less is taken half.
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
