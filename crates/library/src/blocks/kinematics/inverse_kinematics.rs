// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::inverse::{Ranges, Tolerance, in_the_way, inverse_anywhere};
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_POSE};
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// Inverse kinematics: finds q with forward(q) = goal by damped least squares, dq = Jᵀ (J Jᵀ + λ)⁻¹ e, starting from the joint positions
/// `near`.
///
/// The joint ranges are respected. If the goal cannot be reached, q is the closest solution found; `limit` then gives the joint whose
/// range prevents it (0: the first), or, if none does, `unreachable` gives the distance of the tool from the goal (m). `singular` is also
/// reported if the minimum singular value of the Jacobian at q is below the preset: small motions of the tool then require large motions
/// of a joint. The computation time is bounded: at most 80 iterations per attempt, about 10 µs each; the first attempt starts from
/// `near`, the others from other positions within the ranges. Source: Sugihara, IEEE Transactions on Robotics 27(5), 2011. Faults: 1 the
/// arm is not a chain of n joints; 2 a joint position is not finite, or the quaternion of the goal is not a unit quaternion.
#[derive(FunctionBlock)]
pub struct InverseKinematics {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// goal pose of the tool: x y z in m, quaternion w x y z
    #[input(asynchronous, range = "[pose]")]
    goal: [f64; 7],
    /// joint positions at which the search starts, rad or m
    #[input(asynchronous, sized)]
    near: [f64; 16],
    /// minimum position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized, range = "[-inf, inf)")]
    position_min: [f64; 16],
    /// maximum position of each joint
    #[input(asynchronous, default = [1e6; 16], sized, range = "[-inf, inf)")]
    position_max: [f64; 16],
    /// joint positions found, rad or m
    #[output(sized)]
    q: [f64; 16],
    /// true if the tool reaches the goal with these positions
    #[output]
    reached: bool,
    /// distance of the tool from the goal
    #[output(unit = "m")]
    position_error: f64,
    /// angle between the tool and the goal
    #[output(unit = "rad")]
    angle_error: f64,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// maximum distance at which the goal counts as reached
    #[param(default = 1e-6, unit = "m", range = "(0, inf)")]
    tolerance: f64,
    /// maximum angle at which the goal counts as reached
    #[param(default = 1e-6, unit = "rad", range = "(0, inf)")]
    angle_tolerance: f64,
    /// true: the tool must also reach the orientation of the goal
    #[param(default = true)]
    orientation: bool,
    /// number of starting positions to try, `near` first
    #[param(default = 1, range = "[1, 1000]")]
    attempts: u32,
    /// the goal is out of reach; the value is the distance of the tool from it, m
    #[condition]
    unreachable: ConditionOf<f64>,
    /// the range of a joint prevents reaching the goal; the value is the index of the joint, from 0
    #[condition]
    limit: ConditionOf<i32>,
    /// the minimum singular value is below the preset; the value is that singular value
    #[condition(preset = 0.02, range = "[0, inf)")]
    singular: ConditionOf<f64>,
}

impl Step for InverseKinematics {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        let Some(arm) = self.chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        let (Some(goal), true) = (Pose::of(&self.goal), self.near[..n].iter().all(|q| q.is_finite())) else { return Outcome::Fault(BAD_POSE) };
        let ranges = Ranges { min: &self.position_min[..n], max: &self.position_max[..n] };
        let tolerance = Tolerance { position: self.tolerance, angle: self.angle_tolerance, orientation: self.orientation };
        let found = inverse_anywhere(&arm, &goal, &self.near[..n], ranges, tolerance, self.attempts);
        (self.q, self.reached) = (found.q, found.reached);
        (self.position_error, self.angle_error) = (found.position_error, found.angle_error);
        if !found.reached {
            match in_the_way(&arm, &goal, &self.near[..n], &found, tolerance, self.attempts) {
                Some(joint) => self.limit.report(joint as i32),
                None => self.unreachable.report(found.position_error),
            }
        }
        let least = arm.least_singular_value(&arm.jacobian(&arm.posture(&found.q[..n])));
        if least < self.singular.preset {
            self.singular.report(least);
        }
        Outcome::Done
    }
}
