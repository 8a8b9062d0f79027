// SPDX-License-Identifier: Apache-2.0
//! Decoupled efforts: computed torque in the drive, under dry friction and within the limits of the motors.
//!
//! **Friction.** The motor of a joint compensates its dry friction: in proportion to the requested velocity up to `SPEED_OF_FRICTION`,
//! and fully above it, so that a joint at rest does not chatter. A joint that is nevertheless held by friction does not accelerate,
//! whatever is requested: the other joints are computed with its actual acceleration. The friction is the plant's own (see
//! [`Plant::load_efforts`]), because MuJoCo's is a soft constraint, and a motor that is computed with a friction different from the
//! actual one makes the arm oscillate.
//!
//! **Limits.** If a motor cannot provide the required effort, the accelerations of all joints in its tree are reduced by the same factor,
//! as far as gravity allows: if only that motor were limited, the others would push the arm off its path. A motor that cannot hold its
//! joint provides its maximum effort, and the other joints are computed with that effort.
use super::plant::Plant;

/// Velocity above which a motor compensates the whole friction of its joint: rad/s, or m/s for a prismatic joint.
const SPEED_OF_FRICTION: f64 = 2e-3;
const SPEED_OF_FRICTION_M: f64 = 2e-4;

impl Plant {
    /// Returns true if a joint is moved by a decoupled effort.
    pub(super) fn is_decoupled(&self, j: usize) -> bool {
        !self.braked[self.arm.joints[j].velocity] && self.slowing[j] == 0 && self.decoupled[j].is_finite()
    }

    /// Adds the efforts that give each decoupled joint the acceleration that its decoupled effort would cause if the joint moved only its
    /// own inertia.
    pub(super) fn load_decoupled(&mut self) {
        // Other trees of bodies do not feel the arm: they are left out of the equations.
        for i in 0..self.bias.len() {
            self.given[i] = self.braked[i] || self.arm.apart[i];
        }
        for j in 0..self.arm.joints.len() {
            if self.is_decoupled(j) {
                self.given[self.arm.joints[j].velocity] = true;
            }
        }
        self.need();
        if (0..self.arm.joints.len()).any(|j| self.is_given(j) && self.is_beyond(j, self.needed[self.arm.joints[j].velocity])) {
            self.keep_to_motors();
        }
        for j in 0..self.arm.joints.len() {
            if self.is_given(j) {
                let joint = &self.arm.joints[j];
                let most = joint.part.effort_max;
                self.forces[joint.velocity] = self.needed[joint.velocity].clamp(-most, most);
            }
        }
    }

    /// Returns true if a joint is decoupled and its motor can hold it.
    fn is_given(&self, j: usize) -> bool {
        self.is_decoupled(j) && self.given[self.arm.joints[j].velocity]
    }

    /// Returns true if an effort exceeds the limit of the motor.
    fn is_beyond(&self, j: usize, effort: f64) -> bool {
        effort.abs() > self.arm.joints[j].part.effort_max
    }

    /// Computes the efforts that the decoupled joints need for the requested accelerations, and the friction during that motion.
    fn need(&mut self) {
        let step_s = self.step_s();
        self.accelerations.fill(0.0);
        for j in 0..self.arm.joints.len() {
            if self.is_given(j) {
                let joint = &self.arm.joints[j];
                let (v, inertia, asked) = (joint.velocity, joint.inertia, self.decoupled[j] / joint.inertia);
                let (friction, speed) = (self.arm.plant_friction[v], self.state[self.positions + v]);
                let whole = if joint.part.unit == "m" { SPEED_OF_FRICTION_M } else { SPEED_OF_FRICTION };
                let made_up = friction * ((speed + step_s * asked) / whole).clamp(-1.0, 1.0);
                // Friction that stops the joint within this step, up to its limit.
                self.rubbing[v] = (-inertia * (asked + speed / step_s) - made_up).clamp(-friction, friction);
                self.accelerations[v] = asked + (made_up + self.rubbing[v]) / inertia;
            }
        }
        let efforts = std::mem::take(&mut self.needed);
        self.needed = self.efforts_for(efforts);
    }

    /// Computes the efforts that the decoupled joints need for zero acceleration under the same friction.
    fn stand(&mut self) {
        self.accelerations.fill(0.0);
        let efforts = std::mem::take(&mut self.standing);
        self.standing = self.efforts_for(efforts);
    }

    /// Returns the efforts that produce the `accelerations` of the decoupled joints.
    fn efforts_for(&mut self, mut efforts: Vec<f64>) -> Vec<f64> {
        efforts.copy_from_slice(&self.forces[..self.bias.len()]);
        self.solve(&mut efforts);
        for j in 0..self.arm.joints.len() {
            if self.is_given(j) {
                let v = self.arm.joints[j].velocity;
                efforts[v] += self.forces[v] - self.rubbing[v];
            }
        }
        efforts
    }

    /// Reduces the requested accelerations until the motors can produce them.
    fn keep_to_motors(&mut self) {
        self.stand();
        while self.give_all() {
            self.need();
            self.stand();
        }
        for j in 0..self.arm.joints.len() {
            if self.is_given(j) {
                let v = self.arm.joints[j].velocity;
                let share = self.share(self.arm.trees[v]);
                // `accelerations` is free now: it stores the result, because `needed` is still read.
                self.accelerations[v] = self.standing[v] + share * (self.needed[v] - self.standing[v]);
            }
        }
        for j in 0..self.arm.joints.len() {
            if self.is_given(j) {
                let v = self.arm.joints[j].velocity;
                self.needed[v] = self.accelerations[v];
            }
        }
    }

    /// Sets the motors that cannot hold their joints to their maximum effort; returns false if there are none.
    fn give_all(&mut self) -> bool {
        let mut is_any = false;
        for j in 0..self.arm.joints.len() {
            let (v, most) = (self.arm.joints[j].velocity, self.arm.joints[j].part.effort_max);
            let (standing, needed) = (self.standing[v], self.needed[v]);
            if self.is_given(j) && self.is_beyond(j, standing) && self.is_beyond(j, needed) && standing * needed > 0.0 {
                (self.forces[v], self.given[v]) = (most.copysign(needed), false);
                is_any = true;
            }
        }
        is_any
    }

    /// Returns the maximum fraction of the requested accelerations that all motors of a tree can produce.
    fn share(&self, tree: i32) -> f64 {
        let of = |j: usize| {
            let (v, most) = (self.arm.joints[j].velocity, self.arm.joints[j].part.effort_max);
            let (standing, needed) = (self.standing[v], self.needed[v]);
            if !self.is_beyond(j, needed) || self.is_beyond(j, standing) { 1.0 } else { (most.copysign(needed) - standing) / (needed - standing) }
        };
        let joints = (0..self.arm.joints.len()).filter(|j| self.is_given(*j) && self.arm.trees[self.arm.joints[*j].velocity] == tree);
        joints.map(of).fold(1.0, f64::min)
    }
}
