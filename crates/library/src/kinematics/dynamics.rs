// SPDX-License-Identifier: Apache-2.0
//! Joint efforts of a motion of an arm, by the recursive Newton-Euler equations.
//!
//! The outward pass from the base computes the velocity and acceleration of each link; in the inward pass from the tip, each joint
//! carries the forces of the links beyond it (Luh, Walker and Paul, *On-line computational scheme for mechanical manipulators*, 1980).
//! Gravity is included as an acceleration of the base. The computation time grows linearly with the number of joints.
use super::JOINTS_MAX;
use super::chain::{Arm, HINGE, SLIDE};
use super::pose::{add, conjugate, cross, rotate, scale, subtract};
use opengpac::Type;

/// Mass properties of the links of a chain; the link of a joint is everything that moves with the joint. Positions and directions are in
/// the base's frame, with every joint at 0.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Links {
    /// Mass of each link, kg.
    pub mass: [f64; JOINTS_MAX],
    /// Centre of mass of each link, m.
    pub centre: [[f64; 3]; JOINTS_MAX],
    /// Inertia of each link about its centre of mass, kg m²: xx, yy, zz, xy, xz, yz.
    pub inertia: [[f64; 6]; JOINTS_MAX],
    /// Inertia of each joint's motor, reflected to the joint, kg m² or kg.
    pub armature: [f64; JOINTS_MAX],
}

/// Positions, velocities and accelerations of the joints; each slice has one element per joint.
#[derive(Clone, Copy, Debug)]
pub struct JointMotion<'a> {
    pub q: &'a [f64],
    pub velocity: &'a [f64],
    pub acceleration: &'a [f64],
}

/// Force on a link, its moment about the centre of mass, and the position of that centre relative to the joint's anchor.
#[derive(Clone, Copy, Debug, Default)]
struct Load {
    force: [f64; 3],
    moment: [f64; 3],
    lever: [f64; 3],
}

impl Links {
    /// Links without mass.
    pub const MASSLESS: Links = Links { mass: [0.0; JOINTS_MAX], centre: [[0.0; 3]; JOINTS_MAX], inertia: [[0.0; 6]; JOINTS_MAX], armature: [0.0; JOINTS_MAX] };

    /// Returns true if the first `n` links are valid: no mass or motor inertia is negative, and all numbers are finite.
    pub fn are_sound(&self, n: usize) -> bool {
        (0..n).all(|i| {
            let numbers = [&self.centre[i][..], &self.inertia[i], &[self.mass[i], self.armature[i]]];
            self.mass[i] >= 0.0 && self.armature[i] >= 0.0 && numbers.iter().all(|numbers| numbers.iter().all(|x| x.is_finite()))
        })
    }
}

/// Returns the effort of each joint, N m or N, for a motion of an arm. `gravity` is in the frame of the poses, m/s².
pub fn efforts(arm: &Arm, links: &Links, gravity: [f64; 3], motion: &JointMotion) -> [f64; JOINTS_MAX] {
    let n = arm.joints();
    let (mut axes, mut anchors, mut loads) = ([[0.0; 3]; JOINTS_MAX], [[0.0; 3]; JOINTS_MAX], [Load::default(); JOINTS_MAX]);
    let mut link = *arm.base();
    // Angular velocity and acceleration of the link, and the acceleration of its point `at`.
    let (mut spin, mut spin_up, mut rise, mut at) = ([0.0; 3], [0.0; 3], scale(gravity, -1.0), link.position);
    for i in 0..n {
        let joint = arm.placed(&link, i, motion.q[i]);
        rise = add(rise, swept(spin, spin_up, subtract(joint.anchor, at)));
        let (velocity, acceleration) = (scale(joint.axis, motion.velocity[i]), scale(joint.axis, motion.acceleration[i]));
        match arm.kind(i) {
            HINGE => {
                spin_up = add(spin_up, add(acceleration, cross(spin, velocity)));
                spin = add(spin, velocity);
            }
            SLIDE => rise = add(rise, add(acceleration, scale(cross(spin, velocity), 2.0))),
            _ => {}
        }
        (link, at, axes[i], anchors[i]) = (joint.link, joint.anchor, joint.axis, joint.anchor);
        let lever = subtract(link.point(links.centre[i]), at);
        let force = scale(add(rise, swept(spin, spin_up, lever)), links.mass[i]);
        let about = |v: [f64; 3]| rotate(link.quaternion, times(&links.inertia[i], rotate(conjugate(link.quaternion), v)));
        loads[i] = Load { force, moment: add(about(spin_up), cross(spin, about(spin))), lever };
    }
    let mut efforts = [0.0; JOINTS_MAX];
    let (mut force, mut moment, mut at) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for i in (0..n).rev() {
        let load = &loads[i];
        let carried = add(moment, cross(subtract(at, anchors[i]), force));
        moment = add(add(carried, load.moment), cross(load.lever, load.force));
        (force, at) = (add(force, load.force), anchors[i]);
        let along = match arm.kind(i) {
            HINGE => dot(axes[i], moment),
            SLIDE => dot(axes[i], force),
            _ => continue,
        };
        efforts[i] = along + links.armature[i] * motion.acceleration[i];
    }
    efforts
}

/// Returns the acceleration of a point of a rotating body relative to another point, `way` being the displacement between them.
fn swept(spin: [f64; 3], spin_up: [f64; 3], way: [f64; 3]) -> [f64; 3] {
    add(cross(spin_up, way), cross(spin, cross(spin, way)))
}

/// Returns the product of a symmetric matrix (xx, yy, zz, xy, xz, yz) and a vector.
fn times([xx, yy, zz, xy, xz, yz]: &[f64; 6], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
}

/// a · b.
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::chain::samples::planar;
    use crate::kinematics::chain::{Chain, NONE};

    /// Returns two links of 1 m and 0.5 m. Centres of mass and inertias about z are 3 kg at 0.4 m with 0.2 kg m², and 2 kg at 0.3 m with
    /// 0.1 kg m².
    fn links() -> Links {
        let mut links = Links::MASSLESS;
        links.mass[..2].copy_from_slice(&[3.0, 2.0]);
        links.centre[..2].copy_from_slice(&[[0.4, 0.0, 0.0], [1.3, 0.0, 0.0]]);
        (links.inertia[0][2], links.inertia[1][2]) = (0.2, 0.1);
        links
    }

    #[test]
    fn two_links_need_the_efforts_of_the_textbook() {
        let (chain, links) = (planar(), links());
        let (q, v, a): ([f64; 2], [f64; 2], [f64; 2]) = ([0.3, -0.8], [1.1, -0.7], [2.0, 3.0]);
        let motion = JointMotion { q: &q, velocity: &v, acceleration: &a };
        let found = efforts(&chain.read(2).expect("a chain"), &links, [0.0, -10.0, 0.0], &motion);
        // Spong, Hutchinson and Vidyasagar, Robot Modeling and Control, 2006, section 7.3.
        let (m, l, c, i) = ([3.0, 2.0], 1.0, [0.4, 0.3], [0.2, 0.1]);
        let h = m[1] * l * c[1];
        let d22 = m[1] * c[1] * c[1] + i[1];
        let d12 = d22 + h * q[1].cos();
        let d11 = m[0] * c[0] * c[0] + m[1] * l * l + 2.0 * h * q[1].cos() + m[1] * c[1] * c[1] + i[0] + i[1];
        let lift = 10.0 * m[1] * c[1] * (q[0] + q[1]).cos();
        let wanted = [
            d11 * a[0] + d12 * a[1] - h * q[1].sin() * (2.0 * v[0] * v[1] + v[1] * v[1]) + 10.0 * (m[0] * c[0] + m[1] * l) * q[0].cos() + lift,
            d12 * a[0] + d22 * a[1] + h * q[1].sin() * v[0] * v[0] + lift,
        ];
        assert!((found[0] - wanted[0]).abs() < 1e-12 && (found[1] - wanted[1]).abs() < 1e-12, "{found:?} {wanted:?}");
    }

    #[test]
    fn a_sliding_joint_lifts_what_it_carries_and_feels_its_motor() {
        let mut chain = Chain { joints: 2, ..Chain::NOTHING };
        (chain.kind[0], chain.axis[0]) = (SLIDE, [0.0, 0.0, 1.0]);
        chain.kind[1] = NONE;
        let mut links = Links::MASSLESS;
        (links.mass[0], links.mass[1], links.armature[0]) = (2.0, 1.0, 0.5);
        let motion = JointMotion { q: &[0.1, 9.0], velocity: &[1.0, 9.0], acceleration: &[4.0, 9.0] };
        let found = efforts(&chain.read(2).expect("a chain"), &links, [0.0, 0.0, -10.0], &motion);
        assert!((found[0] - (3.0 * 14.0 + 0.5 * 4.0)).abs() < 1e-12 && found[1] == 0.0, "{found:?}");
    }

    #[test]
    fn what_is_no_link_is_found() {
        assert!(links().are_sound(2) && Links::MASSLESS.are_sound(16));
        assert!(!Links { mass: [-1.0; 16], ..links() }.are_sound(1));
        assert!(!Links { armature: [f64::NAN; 16], ..links() }.are_sound(1));
        assert!(!Links { inertia: [[f64::INFINITY; 6]; 16], ..links() }.are_sound(1));
    }
}
