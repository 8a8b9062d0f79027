// SPDX-License-Identifier: Apache-2.0
//! Poses as seven numbers: x y z in m, then the quaternion w x y z.
use library::kinematics::pose::{self, Numbers, Pose};
use pyo3::prelude::*;

/// Returns the seven numbers with the quaternion normalised; None if its norm is not close to 1, or if a number is not finite.
#[pyfunction]
pub fn pose_of(numbers: Numbers) -> Option<Numbers> {
    Pose::of(&numbers).map(|pose| pose.numbers())
}

/// Returns the pose with this position and these roll, pitch and yaw angles, rad.
#[pyfunction]
pub fn pose_of_rpy(position: [f64; 3], rpy: [f64; 3]) -> Numbers {
    Pose::of_rpy(position, rpy).numbers()
}

/// Returns roll, pitch and yaw, rad.
#[pyfunction]
pub fn pose_rpy(pose: Numbers) -> [f64; 3] {
    read(pose).rpy()
}

/// Transforms the pose `inner`, expressed in the frame `outer`, to the reference frame of `outer`.
#[pyfunction]
pub fn pose_then(outer: Numbers, inner: Numbers) -> Numbers {
    read(outer).then(&read(inner)).numbers()
}

/// Transforms a point in a frame to the reference frame of that frame.
#[pyfunction]
pub fn pose_point(frame: Numbers, point: [f64; 3]) -> [f64; 3] {
    read(frame).point(point)
}

/// Returns the inverse of a pose: the pose of the reference frame, expressed in the frame.
#[pyfunction]
pub fn pose_inverse(pose: Numbers) -> Numbers {
    read(pose).inverse().numbers()
}

/// Returns the distance between two poses, m, and the angle between them, rad, 0 to pi.
#[pyfunction]
pub fn pose_between(from: Numbers, to: Numbers) -> (f64, f64) {
    let (way, turn) = read(from).to(&read(to));
    (pose::length(way), pose::length(turn))
}

/// Converts numbers returned by `pose_of`.
fn read([x, y, z, w, i, j, k]: Numbers) -> Pose {
    Pose { position: [x, y, z], quaternion: [w, i, j, k] }
}
