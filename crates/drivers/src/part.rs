// SPDX-License-Identifier: Apache-2.0
//! What a driver says about the parts of its machine, so that logical devices can be made for them.
use serde::Serialize;

/// A joint that can be commanded: its channels are `<name>.position`, `<name>.velocity`, `<name>.bias` and `<name>.effort`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    pub name: String,
    /// Unit of its position: `rad` (hinge) or `m` (slide).
    pub unit: &'static str,
    /// Least and greatest position. [`UNLIMITED`] either way where the model has no limit.
    pub range_min: f64,
    pub range_max: f64,
    /// Greatest effort either way, N.m or N; [`UNLIMITED`] where the model has no limit.
    pub effort_max: f64,
    /// Greatest speed either way, rad/s or m/s; [`UNLIMITED`] where the model has no limit.
    pub speed_max: f64,
    /// Position at the start: the model's keyframe `home`, or its zero configuration.
    pub home: f64,
    /// Gains that suit the inertia that moves with this joint.
    pub servo: Servo,
}

/// What stands for "no limit" in a [`Part`]: a number, so that it can be a parameter's value.
pub const UNLIMITED: f64 = 1e6;

/// Gains of a position servo at 1 kHz with bias compensation: effort = kp (setpoint - position) - kd velocity + bias.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Servo {
    /// N.m/rad or N/m.
    pub kp: f64,
    /// N.m.s/rad or N.s/m.
    pub kd: f64,
}
