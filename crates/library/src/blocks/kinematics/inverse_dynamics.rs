// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::dynamics::{JointMotion, Links, efforts};
use crate::kinematics::{BAD_CHAIN, BAD_LINKS, BAD_POSE, JOINTS_MAX};
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Inverse dynamics: effort = M(q) q'' + C(q, q') q' + g(q), the joint efforts required for a motion, by the Newton-Euler equations.
///
/// `gravity_effort` is g(q) alone, which holds the arm still. If `velocity` and `acceleration` are not connected, both outputs are equal,
/// so the block performs gravity compensation. Friction and damping are not modelled. `gpac.robots.load(...).dynamics.parameters`
/// contains the chain, links and gravity of an arm; bodies attached to joints that do not move the tool are treated as rigidly attached.
/// Source: Luh, Walker and Paul, Journal of Dynamic Systems, Measurement, and Control 102(2), 1980; Featherstone, *Rigid Body Dynamics
/// Algorithms*, 2008, section 5.3. Faults: 1 the arm is not a chain of n joints; 2 a position, velocity or acceleration is not finite, or
/// gravity is not; 3 the mass of a link or the inertia of its motor is negative, or one of its numbers is not finite.
#[derive(FunctionBlock)]
pub struct InverseDynamics {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// joint positions, rad or m
    #[input(sized)]
    q: [f64; 16],
    /// joint velocities, rad/s or m/s
    #[input(default = [0.0; 16], sized, range = "[-inf, inf)")]
    velocity: [f64; 16],
    /// joint accelerations, rad/s^2 or m/s^2
    #[input(default = [0.0; 16], sized, range = "[-inf, inf)")]
    acceleration: [f64; 16],
    /// efforts required for the motion, N.m or N
    #[output(sized)]
    effort: [f64; 16],
    /// efforts that hold the arm still at q, N.m or N
    #[output(sized)]
    gravity_effort: [f64; 16],
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// mass properties of the arm's links
    #[param(default = Links::MASSLESS)]
    links: Links,
    /// gravity in the frame of the poses, m/s^2
    #[param(default = [0.0, 0.0, -9.81], range = "[-1000, 1000]")]
    gravity: [f64; 3],
}

impl Step for InverseDynamics {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        let Some(arm) = self.chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        let motion = JointMotion { q: &self.q[..n], velocity: &self.velocity[..n], acceleration: &self.acceleration[..n] };
        if ![motion.q, motion.velocity, motion.acceleration, &self.gravity].iter().all(|numbers| numbers.iter().all(|x| x.is_finite())) {
            return Outcome::Fault(BAD_POSE);
        }
        if !self.links.are_sound(n) {
            return Outcome::Fault(BAD_LINKS);
        }
        let still = [0.0; JOINTS_MAX];
        self.effort = efforts(&arm, &self.links, self.gravity, &motion);
        self.gravity_effort = efforts(&arm, &self.links, self.gravity, &JointMotion { velocity: &still, acceleration: &still, ..motion });
        Outcome::Done
    }
}
