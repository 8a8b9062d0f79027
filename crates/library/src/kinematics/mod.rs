// SPDX-License-Identifier: Apache-2.0
//! Kinematics and dynamics of an arm: the pose and the velocity of its tool, the joint positions for a pose, and the efforts for a
//! motion.
//!
//! All types have a fixed size, and no function allocates, so blocks on the real-time path can use them.
pub mod chain;
pub mod course;
pub mod dynamics;
pub mod follower;
pub mod inverse;
pub mod line;
pub mod matrix;
pub mod polyline;
pub mod pose;
pub mod tool_jog;

/// Maximum number of joints of a chain.
pub const JOINTS_MAX: usize = 16;
/// The chain has a different number of joints, or one of its axes or frames is not a unit vector or quaternion.
pub const BAD_CHAIN: u32 = 1;
/// A position is not a finite number, or the quaternion of a pose is not a unit quaternion.
pub const BAD_POSE: u32 = 2;
/// A speed, acceleration or jerk limit is not above 0, or an override is not between 0 and 1.
pub const BAD_LIMIT: u32 = 3;
/// There is no planned line: the planner has not run, or has not found one.
pub const NO_PLAN: u32 = 4;
/// A link's mass or its motor's inertia is negative, or one of its numbers is not finite.
pub const BAD_LINKS: u32 = 3;
