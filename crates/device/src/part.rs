// SPDX-License-Identifier: Apache-2.0
//! Parts of a driver's machine, for which logical devices can be created.
use serde::{Deserialize, Serialize};

/// A joint that can be commanded. Its channels are `<name>.position`, `<name>.velocity`, and those of its [`Command`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    pub name: String,
    /// Unit of the position: `rad` (revolute joint) or `m` (prismatic joint).
    pub unit: &'static str,
    /// Minimum and maximum position; [`UNLIMITED`] if the model has no limit in that direction.
    pub range_min: f64,
    pub range_max: f64,
    /// Maximum magnitude of the effort, N.m or N; [`UNLIMITED`] if the model has no limit.
    pub effort_max: f64,
    /// Maximum magnitude of the speed, rad/s or m/s; [`UNLIMITED`] if the model has no limit.
    pub speed_max: f64,
    /// Position at the start: the model's keyframe `home`, or its zero configuration.
    pub home: f64,
    /// Gains suitable for the inertia that moves with this joint. They are meaningless if the machine closes the loop.
    pub servo: Servo,
    /// Command that the machine accepts for this joint.
    pub command: Command,
}

/// Command that a joint accepts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// An effort, in `<name>.effort` (written); `<name>.bias` (read) is the effort that holds the joint. The servo runs in this system.
    #[default]
    Effort,
    /// A position, in `<name>.goal` (written): the machine closes the loop, like the controller of a commercial arm or a hobby servo. The
    /// safe value of that channel is NaN (no goal): the joint stays where it is until a goal is stored.
    Position,
}

/// Value for "no limit" in a [`Part`], usable as the value of a parameter.
pub const UNLIMITED: f64 = 1e6;

/// Gains of a position servo at 1 kHz with bias compensation: effort = kp (setpoint - position) - kd velocity + bias.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Servo {
    /// Proportional gain, N.m/rad or N/m.
    pub kp: f64,
    /// Derivative gain, N.m.s/rad or N.s/m.
    pub kd: f64,
}
