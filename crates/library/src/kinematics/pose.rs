// SPDX-License-Identifier: Apache-2.0
//! Poses: a position and a unit quaternion; composition, rotation and interpolation.
//!
//! A pose is represented by seven numbers: x, y, z in m, then the quaternion w, x, y, z (w first, as in MuJoCo). q and -q represent the
//! same orientation; comparison and interpolation use the shorter rotation.

/// A pose as exchanged between blocks: x y z (m), then the quaternion w x y z.
pub type Numbers = [f64; 7];
/// Tolerance for the length of a quaternion, relative to 1.
const LENGTH_TOLERANCE: f64 = 1e-3;

/// A position and an orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// m
    pub position: [f64; 3],
    /// Unit quaternion, w first.
    pub quaternion: [f64; 4],
}

impl Pose {
    /// Identity pose.
    pub const IDENTITY: Pose = Pose { position: [0.0; 3], quaternion: [1.0, 0.0, 0.0, 0.0] };

    /// Parses seven numbers and normalises the quaternion; returns `None` if a number is not finite or the length is not close to 1.
    pub fn of(numbers: &Numbers) -> Option<Pose> {
        let [x, y, z, w, i, j, k] = *numbers;
        let length = (w * w + i * i + j * j + k * k).sqrt();
        let fine = numbers.iter().all(|x| x.is_finite()) && (length - 1.0).abs() <= LENGTH_TOLERANCE;
        fine.then(|| Pose { position: [x, y, z], quaternion: [w / length, i / length, j / length, k / length] })
    }

    /// Returns the pose as seven numbers.
    pub fn numbers(&self) -> Numbers {
        let ([x, y, z], [w, i, j, k]) = (self.position, self.quaternion);
        [x, y, z, w, i, j, k]
    }

    /// Transforms a point from this frame to its reference frame.
    pub fn point(&self, point: [f64; 3]) -> [f64; 3] {
        add(self.position, rotate(self.quaternion, point))
    }

    /// Transforms the pose `inner` from this frame to its reference frame.
    pub fn then(&self, inner: &Pose) -> Pose {
        Pose { position: self.point(inner.position), quaternion: unit(product(self.quaternion, inner.quaternion)) }
    }

    /// Returns the pose of the reference frame in this frame.
    pub fn inverse(&self) -> Pose {
        let quaternion = conjugate(self.quaternion);
        Pose { position: scale(rotate(quaternion, self.position), -1.0), quaternion }
    }

    /// Returns the pose with this position, rotated by roll, pitch and yaw: about the fixed x, then y, then z axis, rad.
    pub fn of_rpy(position: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Pose {
        let about = [turn([1.0, 0.0, 0.0], roll), turn([0.0, 1.0, 0.0], pitch), turn([0.0, 0.0, 1.0], yaw)];
        Pose { position, quaternion: product(product(about[2], about[1]), about[0]) }
    }

    /// Returns roll, pitch and yaw, rad; pitch is within ± π/2. If only the difference of roll and yaw is defined, yaw is 0.
    pub fn rpy(&self) -> [f64; 3] {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| rotate(self.quaternion, axis));
        let across = x[0].hypot(x[1]);
        let pitch = (-x[2]).atan2(across);
        if across < 1e-9 { [(-z[1]).atan2(y[1]), pitch, 0.0] } else { [y[2].atan2(z[2]), pitch, x[1].atan2(x[0])] }
    }

    /// Returns the displacement from this pose to `goal` (m), and the rotation vector (axis times angle, rad, at most pi), both in the
    /// reference frame.
    pub fn to(&self, goal: &Pose) -> ([f64; 3], [f64; 3]) {
        let turn = product(goal.quaternion, conjugate(self.quaternion));
        (subtract(goal.position, self.position), rotation_vector(turn))
    }

    /// Returns the pose at the fraction `s` (0 to 1) of the displacement and rotation returned by `to`: a straight line, with a uniform
    /// rotation about one axis.
    pub fn along(&self, (way, turn): ([f64; 3], [f64; 3]), s: f64) -> Pose {
        Pose { position: add(self.position, scale(way, s)), quaternion: unit(product(of_rotation_vector(scale(turn, s)), self.quaternion)) }
    }
}

/// a + b.
pub fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b.
pub fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a k.
pub fn scale(a: [f64; 3], k: f64) -> [f64; 3] {
    [a[0] * k, a[1] * k, a[2] * k]
}

/// a × b.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// |a|.
pub fn length(a: [f64; 3]) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

/// Multiplies two quaternions: the rotation b followed by the rotation a.
pub fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// Returns the inverse rotation.
pub fn conjugate(q: [f64; 4]) -> [f64; 4] {
    [q[0], -q[1], -q[2], -q[3]]
}

/// Rotates a vector by a unit quaternion.
pub fn rotate(q: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let u = [q[1], q[2], q[3]];
    let t = scale(cross(u, v), 2.0);
    add(add(v, scale(t, q[0])), cross(u, t))
}

/// Returns the quaternion of a rotation about a unit axis by an angle in rad.
pub fn turn(axis: [f64; 3], angle: f64) -> [f64; 4] {
    let (sine, cosine) = (angle / 2.0).sin_cos();
    [cosine, axis[0] * sine, axis[1] * sine, axis[2] * sine]
}

/// Returns the rotation vector of a unit quaternion: axis times angle (rad, at most pi).
pub fn rotation_vector(q: [f64; 4]) -> [f64; 3] {
    let q = if q[0] < 0.0 { [-q[0], -q[1], -q[2], -q[3]] } else { q };
    let u = [q[1], q[2], q[3]];
    let sine = length(u);
    // Near the identity the angle is twice the sine, with an error of the order of the angle squared.
    if sine < 1e-12 { scale(u, 2.0) } else { scale(u, 2.0 * sine.atan2(q[0]) / sine) }
}

/// Returns the quaternion of a rotation vector.
pub fn of_rotation_vector(v: [f64; 3]) -> [f64; 4] {
    let angle = length(v);
    if angle < 1e-12 { unit([1.0, v[0] / 2.0, v[1] / 2.0, v[2] / 2.0]) } else { turn(scale(v, 1.0 / angle), angle) }
}

/// Normalises a quaternion to length 1.
pub fn unit(q: [f64; 4]) -> [f64; 4] {
    let length = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    [q[0] / length, q[1] / length, q[2] / length, q[3] / length]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn a_quarter_turn_about_z_brings_x_to_y() {
        let frame = Pose { position: [1.0, 2.0, 3.0], quaternion: turn([0.0, 0.0, 1.0], FRAC_PI_2) };
        let point = frame.point([1.0, 0.0, 0.0]);
        assert!(length(subtract(point, [1.0, 3.0, 3.0])) < 1e-15);
        let back = frame.then(&Pose { position: [0.0, 0.0, 0.0], quaternion: conjugate(frame.quaternion) });
        assert!((back.quaternion[0] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_inverse_leads_back_and_roll_pitch_yaw_are_read_as_they_are_written() {
        let frame = Pose::of_rpy([1.0, 2.0, 3.0], [0.3, -0.7, 2.0]);
        let back = frame.inverse().then(&frame);
        assert!(length(back.position) < 1e-15 && length(rotation_vector(back.quaternion)) < 1e-15);
        assert!(frame.rpy().iter().zip([0.3, -0.7, 2.0]).all(|(read, written)| (read - written).abs() < 1e-15));
        let upright = Pose::of_rpy([0.0; 3], [0.4, FRAC_PI_2, 0.1]).rpy();
        assert!((upright[0] - 0.3).abs() < 1e-7 && (upright[1] - FRAC_PI_2).abs() < 1e-7 && upright[2] == 0.0, "{upright:?}");
    }

    #[test]
    fn the_way_goes_the_shorter_turn_and_ends_at_the_goal() {
        let start = Pose { position: [0.0; 3], quaternion: turn([0.0, 1.0, 0.0], 0.4) };
        for angle in [1e-14, 1e-6, 0.3, 3.0, 3.5, 6.0] {
            let goal = Pose { position: [1.0, -2.0, 0.5], quaternion: product(turn([0.6, 0.0, 0.8], angle), start.quaternion) };
            let way = start.to(&goal);
            assert!((length(way.1) - angle.min(2.0 * PI - angle)).abs() < 1e-12, "{angle}");
            let (rest, turn) = start.along(way, 1.0).to(&goal);
            assert!(length(rest) < 1e-15 && length(turn) < 1e-12, "{angle}");
            let (half, _) = start.along(way, 0.5).to(&goal);
            assert!((length(half) - length(way.0) / 2.0).abs() < 1e-15);
        }
    }

    #[test]
    fn what_is_no_pose_is_none() {
        assert!(Pose::of(&[0.0; 7]).is_none(), "no quaternion");
        assert!(Pose::of(&[f64::NAN, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]).is_none());
        assert!(Pose::of(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0]).is_none());
        assert_eq!(Pose::of(&Pose::IDENTITY.numbers()), Some(Pose::IDENTITY));
    }
}
