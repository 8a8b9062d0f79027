// SPDX-License-Identifier: Apache-2.0

/// Inputs of a reference in one invocation.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReferenceInputs {
    pub setpoint: f64,
    /// Speed and acceleration of the set-point, and the time at which it was stored, ns; 0 if the set-point declares none.
    pub velocity: f64,
    pub acceleration: f64,
    pub time_ns: i64,
    /// Position of the joint.
    pub position: f64,
    /// Offset of the readings of the joint.
    pub offset: f64,
    /// Range of positions; `None` if the zero of the joint is unknown, because its positions are then meaningless.
    pub range: Option<(f64, f64)>,
    pub speed_max: f64,
    /// Maximum acceleration when catching up after lost time, or braking because set-points have stopped arriving.
    pub acceleration_max: f64,
    /// Maximum jerk when braking.
    pub jerk_max: f64,
    /// Measured speed of the joint.
    pub joint_velocity: f64,
    /// Maximum distance between reference and joint, and maximum time lost in a single gap, s; 0 means unlimited.
    pub error_max: f64,
    pub gap_max_s: f64,
}
