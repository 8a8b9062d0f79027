// SPDX-License-Identifier: Apache-2.0
//! Poses as seven numbers: x y z in m, then the quaternion w x y z.
use library::kinematics::pose::{self, Numbers, Pose};
use pyo3::prelude::*;

/// Returns the seven numbers with the quaternion normalized; None if its length is not near 1, or a number is not finite.
#[pyfunction]
pub fn pose_of(numbers: Numbers) -> Option<Numbers> {
    Pose::of(&numbers).map(|pose| pose.numbers())
}

/// Returns the pose with a position and roll, pitch and yaw, rad.
#[pyfunction]
pub fn pose_of_rpy(position: [f64; 3], rpy: [f64; 3]) -> Numbers {
    Pose::of_rpy(position, rpy).numbers()
}

/// Returns roll, pitch and yaw, rad.
#[pyfunction]
pub fn pose_rpy(pose: Numbers) -> [f64; 3] {
    read(pose).rpy()
}

/// Returns the pose of `inner`, expressed in the frame `outer`, in the reference of that frame.
#[pyfunction]
pub fn pose_then(outer: Numbers, inner: Numbers) -> Numbers {
    read(outer).then(&read(inner)).numbers()
}

/// Returns a point of a frame in the reference of that frame.
#[pyfunction]
pub fn pose_point(frame: Numbers, point: [f64; 3]) -> [f64; 3] {
    read(frame).point(point)
}

/// Returns the pose of the reference of a frame in that frame.
#[pyfunction]
pub fn pose_inverse(pose: Numbers) -> Numbers {
    read(pose).inverse().numbers()
}

/// Returns the distance between two poses, m, and the angle, rad, 0 to pi.
#[pyfunction]
pub fn pose_between(from: Numbers, to: Numbers) -> (f64, f64) {
    let (way, turn) = read(from).to(&read(to));
    (pose::length(way), pose::length(turn))
}

/// Converts numbers that `pose_of` returned.
fn read([x, y, z, w, i, j, k]: Numbers) -> Pose {
    Pose { position: [x, y, z], quaternion: [w, i, j, k] }
}
