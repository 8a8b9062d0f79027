// SPDX-License-Identifier: Apache-2.0
//! Where the tool of an arm is, how it moves, which joint positions bring it to a pose, and which efforts a motion takes.
//!
//! Everything here is plain numbers of a fixed size: nothing allocates, so blocks on the real-time path call it.
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

/// The maximum number of joints of a chain.
pub const JOINTS_MAX: usize = 16;
/// A chain is made for another number of joints, or one of its axes or frames is no unit vector or quaternion.
pub const BAD_CHAIN: u32 = 1;
/// A position is not a finite number, or a pose has no unit quaternion.
pub const BAD_POSE: u32 = 2;
/// A speed, acceleration or jerk limit is not above 0, or an override is not within 0 and 1.
pub const BAD_LIMIT: u32 = 3;
/// There is no planned line: the planner has not run, or found none.
pub const NO_PLAN: u32 = 4;
/// A link has a negative mass, or a number of it is not finite.
pub const BAD_LINKS: u32 = 3;
