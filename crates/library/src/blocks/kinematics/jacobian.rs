// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::{BAD_CHAIN, BAD_POSE};
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Geometric Jacobian: (v, ω) = J(q) q', the tool's velocity for joint velocities q'.
///
/// Row i of `jacobian` is column i of J: the tool's linear velocity x y z and angular velocity x y z, in the frame of the poses, for unit
/// speed of joint i; so `twist = jacobian.T @ velocity` and `effort = jacobian @ wrench`. `least` is the minimum singular value of J (m
/// and rad mixed), 0 at a singularity. Source: Lynch and Park, *Modern Robotics*, 2017, section 5.1. Faults: 1 the arm is not a chain of
/// n joints; 2 a joint position is not finite.
#[derive(FunctionBlock)]
pub struct Jacobian {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// joint positions, rad or m
    #[input(sized)]
    q: [f64; 16],
    /// for each joint: the tool's linear and angular velocity for unit speed of the joint
    #[output(sized)]
    jacobian: [[f64; 6]; 16],
    /// minimum of the singular values of J that the arm can make nonzero
    #[output]
    least: f64,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
}

impl Step for Jacobian {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        let Some(arm) = self.chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        if !self.q[..n].iter().all(|q| q.is_finite()) {
            return Outcome::Fault(BAD_POSE);
        }
        self.jacobian = arm.jacobian(&arm.posture(&self.q[..n]));
        self.least = arm.least_singular_value(&self.jacobian);
        Outcome::Done
    }
}
