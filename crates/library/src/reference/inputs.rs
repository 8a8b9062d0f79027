// SPDX-License-Identifier: Apache-2.0

/// Inputs of a reference in one invocation.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReferenceInputs {
    pub setpoint: f64,
    /// Speed and acceleration of the set-point, and the time at which it was stored, ns; 0 if it declares none.
    pub velocity: f64,
    pub acceleration: f64,
    pub time_ns: i64,
    /// Position of the joint.
    pub position: f64,
    /// Addition to its readings.
    pub offset: f64,
    /// None where its zero is not known: then its numbers mean nothing.
    pub range: Option<(f64, f64)>,
    pub speed_max: f64,
    /// Maximum acceleration while it catches up after lost time, or brakes because set-points no longer come.
    pub acceleration_max: f64,
    /// Maximum jerk while it brakes.
    pub jerk_max: f64,
    /// Measured speed of the joint.
    pub joint_velocity: f64,
    /// Maximum distance between reference and joint, and time that may be lost at once, s; each 0 for no bound.
    pub error_max: f64,
    pub gap_max_s: f64,
}
