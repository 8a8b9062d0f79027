// SPDX-License-Identifier: Apache-2.0
//! Loads on the plant in one time step: the efforts of the drives and brakes, and the push at the tool.
use super::arm::Tool;
use super::followers::fold;
use super::plant::Plant;
use super::prescribed::Equations;

impl Plant {
    /// Applies the efforts of the commanded joints, dry friction, and the loads on the brakes.
    ///
    /// Dry friction of the arm is a force in this step, computed with the equations that its drives use, and not a MuJoCo constraint (see
    /// [`super::model`]), so that a drive and the machine have the same friction.
    pub(super) fn load_efforts(&mut self) {
        let nv = self.bias.len();
        self.forces[..nv].fill(0.0);
        let (mut is_free, mut is_decoupled) = (false, false);
        for (j, joint) in self.arm.joints.iter().enumerate() {
            if !self.braked[joint.velocity] {
                let most = joint.part.effort_max;
                let speed = self.state[self.positions + joint.velocity];
                self.forces[joint.velocity] = if self.slowing[j] > 0 { -most.copysign(speed) } else { self.efforts[j].clamp(-most, most) };
                is_free = true;
                is_decoupled |= self.is_decoupled(j);
            }
        }
        let is_braked = self.braked.contains(&true);
        if self.arm.rubs || (is_free && (is_braked || is_decoupled)) {
            self.load_dynamics();
        }
        if is_decoupled {
            self.load_decoupled();
        }
        for (motor, joint) in self.motors.iter_mut().zip(&self.arm.joints) {
            *motor = self.forces[joint.velocity];
        }
        if self.arm.rubs || (is_free && is_braked) {
            self.load_brakes_and_friction();
        }
    }

    /// Adds the loads on the brakes, and the friction of all other joints under their current efforts.
    fn load_brakes_and_friction(&mut self) {
        let mut forces = std::mem::take(&mut self.forces);
        self.given.copy_from_slice(&self.braked);
        self.accelerations.fill(0.0);
        self.rubbing.fill(0.0);
        self.solve(&mut forces[..self.bias.len()]);
        for (force, rubbing) in forces.iter_mut().zip(&self.rubbing) {
            *force += rubbing;
        }
        self.forces = forces;
    }

    /// Solves the equations of this step for the `efforts` of the joints with prescribed accelerations, and for the friction of the
    /// others.
    pub(super) fn solve(&mut self, efforts: &mut [f64]) {
        let nv = self.bias.len();
        let velocity = &self.state[self.positions..][..nv];
        let of = Equations { inertia: &self.inertia, drift: &self.drift, friction: &self.arm.plant_friction, velocity, step_s: self.step_s() };
        self.prescribed.efforts(&of, &self.given, &self.accelerations, efforts, &mut self.rubbing);
    }

    /// Returns the time step of the simulation, s.
    pub(super) fn step_s(&self) -> f64 {
        self.arm.timestep_ns as f64 * 1e-9
    }

    /// Computes the inertia and all forces except efforts, as used by the next step: an implicit integrator adds the damping of one step
    /// to the inertia. The contributions of followers are included.
    fn load_dynamics(&mut self) {
        self.weigh();
        let (nv, step_s) = (self.bias.len(), self.step_s());
        // SAFETY: model and data belong together; `inertia` has nv * nv elements.
        unsafe { (self.arm.mujoco.mj_fullM)(self.arm.model, self.motion.data(), self.inertia.as_mut_ptr()) };
        for i in 0..nv {
            self.drift[i] = -self.bias[i] - self.arm.damping[i] * self.state[self.positions + i];
            if !self.arm.runge_kutta {
                self.inertia[i * (nv + 1)] += step_s * self.arm.damping[i];
            }
        }
        fold(&self.arm.followers, &self.state[..self.positions], &mut self.inertia, &mut self.drift);
    }

    /// Applies the push at the tool as a force and a torque at the centre of mass of its body, where MuJoCo expects them.
    pub(super) fn load_push(&mut self) {
        let Some(tool) = &self.arm.tool else { return };
        let (site, centre) = (self.world(tool, &tool.site_m), self.world(tool, &tool.centre_m));
        let arm: [f64; 3] = std::array::from_fn(|k| site[k] - centre[k]);
        let force = self.push;
        let torque = [arm[1] * force[2] - arm[2] * force[1], arm[2] * force[0] - arm[0] * force[2], arm[0] * force[1] - arm[1] * force[0]];
        let place = self.bias.len() + 6 * tool.body as usize;
        self.forces[place..place + 3].copy_from_slice(&force);
        self.forces[place + 3..place + 6].copy_from_slice(&torque);
    }

    /// Returns the world coordinates of a point of the tool's body.
    fn world(&self, tool: &Tool, point_m: &[f64; 3]) -> [f64; 3] {
        let (mut place, mut turn, upright) = ([0.0; 3], [0.0; 9], [1.0, 0.0, 0.0, 0.0]);
        // SAFETY: the body is one of this model, and the arrays have the sizes of the header.
        unsafe {
            (self.arm.mujoco.mj_local2Global)(self.motion.data(), place.as_mut_ptr(), turn.as_mut_ptr(), point_m.as_ptr(), upright.as_ptr(), tool.body, 0)
        };
        place
    }
}
