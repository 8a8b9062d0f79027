// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::{BAD_CHAIN, BAD_POSE};
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Forward kinematics: pose = base exp(ξ₁ q₁) … exp(ξₙ qₙ) home tool, the product of exponentials of the joints' axes.
///
/// A pose is x, y, z in m, followed by a unit quaternion, w first. `gpac.robots.load(...).chain` is the chain of an arm. Source: Lynch
/// and Park, *Modern Robotics*, 2017, section 4.1. Faults: 1 the arm is not a chain of n joints; 2 a joint position is not finite.
#[derive(FunctionBlock)]
pub struct ForwardKinematics {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// joint positions, rad or m
    #[input(sized)]
    q: [f64; 16],
    /// pose of the tool: x y z in m, quaternion w x y z
    #[output]
    pose: [f64; 7],
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
}

impl Step for ForwardKinematics {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        let Some(arm) = self.chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        if !self.q[..n].iter().all(|q| q.is_finite()) {
            return Outcome::Fault(BAD_POSE);
        }
        self.pose = arm.posture(&self.q[..n]).tool.numbers();
        Outcome::Done
    }
}
