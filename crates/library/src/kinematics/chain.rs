// SPDX-License-Identifier: Apache-2.0
//! Chain of joints from the base of an arm to its tool, as a product of exponentials.
//!
//! Each joint is described by a line in space, with the arm at zero: its axis and a point on it. The pose of the tool is base exp(ξ₁ q₁)
//! … exp(ξₙ qₙ) home tool (Brockett, *Robotic manipulators and the product of exponentials formula*, 1984; Lynch and Park, *Modern
//! Robotics*, 2017, section 4.1), so no link frames need to be chosen.
use super::JOINTS_MAX;
use super::matrix::{Square, eigenvalues};
use super::pose::{Numbers, Pose, add, cross, length, product, rotate, scale, subtract, turn};
use opengpac::Type;

/// A joint that does not move the tool, such as a finger.
pub const NONE: i32 = 0;
/// A revolute joint; its position is in rad.
pub const HINGE: i32 = 1;
/// A prismatic joint; its position is in m.
pub const SLIDE: i32 = 2;

/// A kinematic chain. Poses are x y z (m), then the quaternion w x y z.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Chain {
    /// Number of joints.
    pub joints: i32,
    /// Kind of each joint: 0 does not move the tool, 1 revolute, 2 prismatic.
    pub kind: [i32; JOINTS_MAX],
    /// Pose of the arm's base in the frame of the poses.
    pub base: Numbers,
    /// Pose of the flange in the frame of the base, with every joint at 0.
    pub home: Numbers,
    /// Pose of the tool in the frame of the flange.
    pub tool: Numbers,
    /// Unit vector along each joint's axis, in the frame of the base, with every joint at 0.
    pub axis: [[f64; 3]; JOINTS_MAX],
    /// Point on each axis, in the frame of the base, with every joint at 0.
    pub anchor: [[f64; 3]; JOINTS_MAX],
}

impl Chain {
    /// An undefined chain, which is not valid for any arm.
    pub const NOTHING: Chain = Chain {
        joints: 0,
        kind: [NONE; JOINTS_MAX],
        base: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        home: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        tool: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        axis: [[0.0; 3]; JOINTS_MAX],
        anchor: [[0.0; 3]; JOINTS_MAX],
    };

    /// Parses the frames of the chain; `None` if it is not valid for `n` joints.
    pub fn read(&self, n: usize) -> Option<Arm<'_>> {
        let fine = |i: usize| match self.kind[i] {
            NONE => true,
            HINGE | SLIDE => (length(self.axis[i]) - 1.0).abs() < 1e-6 && self.anchor[i].iter().all(|x| x.is_finite()),
            _ => false,
        };
        if self.joints != n as i32 || n > JOINTS_MAX || !(0..n).all(fine) {
            return None;
        }
        Some(Arm { chain: self, base: Pose::of(&self.base)?, end: Pose::of(&self.home)?.then(&Pose::of(&self.tool)?), n })
    }
}

/// A validated chain with its frames parsed.
#[derive(Clone, Copy, Debug)]
pub struct Arm<'a> {
    chain: &'a Chain,
    base: Pose,
    /// Pose of the tool in the frame of the base, with every joint at 0.
    end: Pose,
    n: usize,
}

/// Pose of the tool and axes of the joints, in the frame of the poses.
#[derive(Clone, Copy, Debug)]
pub struct Posture {
    /// Pose of the tool.
    pub tool: Pose,
    /// Directions of the axes.
    axis: [[f64; 3]; JOINTS_MAX],
    /// Points on the axes.
    anchor: [[f64; 3]; JOINTS_MAX],
}

/// A joint at a given position, in the frame of the poses, with the frame of the link that it moves (the frame of the base if every joint
/// is at 0).
#[derive(Clone, Copy, Debug)]
pub struct PlacedJoint {
    pub axis: [f64; 3],
    /// A point on the axis.
    pub anchor: [f64; 3],
    pub link: Pose,
}

impl Arm<'_> {
    /// Returns the number of joints.
    pub fn joints(&self) -> usize {
        self.n
    }

    /// Returns the pose of the base in the frame of the poses.
    pub fn base(&self) -> &Pose {
        &self.base
    }

    /// Returns true if `joint` moves the tool.
    pub fn moves(&self, joint: usize) -> bool {
        self.chain.kind[joint] != NONE
    }

    /// Returns the kind of a joint: `NONE`, `HINGE` or `SLIDE`.
    pub fn kind(&self, joint: usize) -> i32 {
        self.chain.kind[joint]
    }

    /// Returns a joint at position `q` (rad or m), mounted on the previous link `before`.
    pub fn placed(&self, before: &Pose, joint: usize, q: f64) -> PlacedJoint {
        let own = self.chain.anchor[joint];
        let (axis, anchor, mut link) = (rotate(before.quaternion, self.chain.axis[joint]), before.point(own), *before);
        match self.chain.kind[joint] {
            HINGE => {
                link.quaternion = product(link.quaternion, turn(self.chain.axis[joint], q));
                link.position = subtract(anchor, rotate(link.quaternion, own));
            }
            SLIDE => link.position = add(link.position, scale(axis, q)),
            _ => {}
        }
        PlacedJoint { axis, anchor, link }
    }

    /// Computes the tool pose and the axes for these joint positions (one for each joint, rad or m).
    pub fn posture(&self, q: &[f64]) -> Posture {
        let mut at = self.base;
        let mut posture = Posture { tool: at, axis: [[0.0; 3]; JOINTS_MAX], anchor: [[0.0; 3]; JOINTS_MAX] };
        for (i, q) in q.iter().enumerate().take(self.n) {
            let joint = self.placed(&at, i, *q);
            (posture.axis[i], posture.anchor[i], at) = (joint.axis, joint.anchor, joint.link);
        }
        posture.tool = at.then(&self.end);
        posture
    }

    /// Computes the geometric Jacobian, one row for each joint: the tool's linear (m/s) and angular (rad/s) velocity for unit joint
    /// speed.
    pub fn jacobian(&self, posture: &Posture) -> [[f64; 6]; JOINTS_MAX] {
        let mut rows = [[0.0; 6]; JOINTS_MAX];
        for (i, row) in rows.iter_mut().enumerate().take(self.n) {
            let axis = posture.axis[i];
            let (linear, angular) = match self.chain.kind[i] {
                HINGE => (cross(axis, subtract(posture.tool.position, posture.anchor[i])), axis),
                SLIDE => (axis, [0.0; 3]),
                _ => continue,
            };
            *row = [linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]];
        }
        rows
    }

    /// Returns the minimum of the singular values of a Jacobian that this arm can make nonzero; with fewer than six joints, there is one
    /// per joint.
    pub fn least_singular_value(&self, jacobian: &[[f64; 6]; JOINTS_MAX]) -> f64 {
        let moving = (0..self.n).filter(|i| self.moves(*i)).count();
        match moving {
            0 => 0.0,
            _ => eigenvalues(&gram(&jacobian[..self.n]))[moving.min(6) - 1].max(0.0).sqrt(),
        }
    }
}

/// Computes J Jᵀ for a Jacobian with one row for each joint.
pub fn gram(rows: &[[f64; 6]]) -> Square {
    std::array::from_fn(|i| std::array::from_fn(|j| rows.iter().map(|row| row[i] * row[j]).sum()))
}

/// Sample chains for the tests in this and other files.
#[cfg(test)]
pub mod samples {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// Joint positions of `six_joints` far from all singularities: upper arm up, forearm level, tool down.
    pub const HOME: [f64; 6] = [0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, -FRAC_PI_2, 0.0];

    /// Returns a chain of two links, of 1 m and 0.5 m, in a plane.
    pub fn planar() -> Chain {
        let mut chain = Chain { joints: 2, home: [1.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], ..Chain::NOTHING };
        for (i, x) in [0.0, 1.0].into_iter().enumerate() {
            (chain.kind[i], chain.axis[i], chain.anchor[i]) = (HINGE, [0.0, 0.0, 1.0], [x, 0.0, 0.0]);
        }
        chain
    }

    /// Returns an arm with the geometry of a UR5e (published Denavit-Hartenberg parameters) and the tool along the last axis.
    pub fn six_joints() -> Chain {
        let (d1, a2, a3, d4, d5, d6) = (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996);
        let x = a2 + a3;
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let axes = [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]];
        let anchors = [[0.0; 3], [0.0, 0.0, d1], [a2, 0.0, d1], [x, 0.0, d1], [x, -d4, d1], [x, -d4, d1 - d5]];
        let mut chain = Chain { joints: 6, home: [x, -d4 - d6, d1 - d5, half, half, 0.0, 0.0], ..Chain::NOTHING };
        chain.kind[..6].fill(HINGE);
        chain.axis[..6].copy_from_slice(&axes);
        chain.anchor[..6].copy_from_slice(&anchors);
        chain
    }
}

#[cfg(test)]
mod tests {
    use super::samples::{planar, six_joints};
    use super::*;

    #[test]
    fn two_links_in_the_plane_are_where_trigonometry_says() {
        let chain = planar();
        let arm = chain.read(2).expect("a chain");
        let q: [f64; 2] = [0.3, -0.8];
        let tool = arm.posture(&q).tool;
        let sum = q[0] + q[1];
        assert!((tool.position[0] - q[0].cos() - 0.5 * sum.cos()).abs() < 1e-15);
        assert!((tool.position[1] - q[0].sin() - 0.5 * sum.sin()).abs() < 1e-15);
        assert!((tool.quaternion[3] - (sum / 2.0).sin()).abs() < 1e-15);
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_pose() {
        let chain = six_joints();
        let arm = chain.read(6).expect("a chain");
        let q = [0.2, -1.1, 1.3, -0.4, -1.2, 0.7];
        let posture = arm.posture(&q);
        let rows = arm.jacobian(&posture);
        for i in 0..6 {
            let step = 1e-6;
            let (mut low, mut high) = (q, q);
            (low[i], high[i]) = (q[i] - step, q[i] + step);
            let (way, turn) = arm.posture(&low).tool.to(&arm.posture(&high).tool);
            for k in 0..3 {
                assert!((way[k] / (2.0 * step) - rows[i][k]).abs() < 1e-9 && (turn[k] / (2.0 * step) - rows[i][3 + k]).abs() < 1e-9, "joint {i}");
            }
        }
        assert!(arm.least_singular_value(&rows) > 0.01);
        let straight = arm.posture(&[0.0, 0.0, 0.0, -0.4, -1.2, 0.7]);
        assert!(arm.least_singular_value(&arm.jacobian(&straight)) < 1e-8, "a straight elbow");
    }

    #[test]
    fn a_sliding_joint_moves_along_its_axis_and_a_finger_does_not_move_the_tool() {
        let mut chain = planar();
        (chain.joints, chain.kind[2], chain.axis[2]) = (4, SLIDE, [0.0, 0.0, 1.0]);
        let arm = chain.read(4).expect("a chain");
        let posture = arm.posture(&[0.3, 0.4, 0.25, 9.0]);
        assert!((posture.tool.position[2] - 0.25).abs() < 1e-15);
        assert_eq!(arm.jacobian(&posture)[2..4], [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0; 6]]);
    }

    #[test]
    fn what_is_no_chain_is_refused() {
        assert!(Chain::NOTHING.read(2).is_none());
        assert!(planar().read(3).is_none());
        assert!(Chain { axis: [[0.0; 3]; 16], ..planar() }.read(2).is_none());
        assert!(Chain { tool: [0.0; 7], ..planar() }.read(2).is_none());
    }
}
