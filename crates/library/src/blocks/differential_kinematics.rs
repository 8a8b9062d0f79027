// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::inverse::{Ranges, inverse};
use crate::kinematics::line::ON_THE_LINE;
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_POSE};
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// Differential kinematics: setpoint += J⁻¹ (pose - forward(setpoint)), a pose that moves a little becomes joint positions that move a little.
///
/// For a generator of poses that moves on its own: a compliant law, a joystick, a camera. It begins at `start` (where the joints are
/// commanded to be) and follows from one invocation to the next, so the arm keeps its posture. No joint is given a step above its
/// greatest speed or beyond its range: then all joints go the same part of their way, `behind` says how far the tool is from
/// the pose, and `slowed` is reported; the rest is made up later. For a straight line that is known from the beginning, use
/// `line_planner`, which looks ahead.
/// Faults: 1 the chain is not one for n joints; 2 a position is not finite or the pose has no unit quaternion.
#[derive(FunctionBlock)]
pub struct DifferentialKinematics {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// where the tool is to be: x y z in m, quaternion w x y z
    #[input]
    pose: [f64; 7],
    /// where the joints are commanded to be at the beginning, rad or m
    #[input(asynchronous, sized)]
    start: [f64; 16],
    /// greatest speed of each joint
    #[input(asynchronous, default = [std::f64::consts::PI; 16], sized)]
    speed_max: [f64; 16],
    /// least position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized)]
    position_min: [f64; 16],
    /// greatest position of each joint
    #[input(asynchronous, default = [1e6; 16], sized)]
    position_max: [f64; 16],
    /// where the joints are to be, rad or m
    #[output(sized)]
    setpoint: [f64; 16],
    /// how far the tool is from the pose there
    #[output(unit = "m")]
    behind: f64,
    /// how far it is turned from it
    #[output(unit = "rad")]
    turned: f64,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// a joint would have been too fast, or the pose cannot be had
    #[condition]
    slowed: Condition,
    /// the tool is farther behind than the preset (0: off); the value is how far, m
    #[condition(preset = 0.0)]
    lost: ConditionOf<f64>,
    /// whether it has begun
    #[state]
    begun: bool,
    /// running time of the invocation before, ns
    #[state]
    before_ns: i64,
    /// joint positions of the invocation before
    #[state]
    q: [f64; 16],
}

impl Step for DifferentialKinematics {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let chain = self.chain;
        let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        let (Some(pose), true) = (Pose::of(&self.pose), self.start[..n].iter().all(|q| q.is_finite())) else { return Outcome::Fault(BAD_POSE) };
        if !self.begun {
            (self.begun, self.before_ns, self.q) = (true, invocation.time_ns, self.start);
        }
        let span_s = (invocation.time_ns - self.before_ns) as f64 * 1e-9;
        self.before_ns = invocation.time_ns;
        let ranges = Ranges { least: &self.position_min[..n], greatest: &self.position_max[..n] };
        let found = inverse(&arm, &pose, &self.q[..n], ranges, ON_THE_LINE);
        let mut part: f64 = 1.0;
        for i in 0..n {
            let way = (found.q[i] - self.q[i]).abs();
            if way > self.speed_max[i] * span_s {
                part = part.min(self.speed_max[i] * span_s / way);
            }
        }
        for i in 0..n {
            self.q[i] += (found.q[i] - self.q[i]) * part;
        }
        let (way, turn) = arm.posture(&self.q[..n]).tool.to(&pose);
        (self.setpoint, self.behind, self.turned) = (self.q, crate::kinematics::pose::length(way), crate::kinematics::pose::length(turn));
        if part < 1.0 || !found.reached {
            self.slowed.report();
        }
        if self.lost.preset > 0.0 && self.behind > self.lost.preset {
            self.lost.report(self.behind);
        }
        Outcome::Done
    }
}
