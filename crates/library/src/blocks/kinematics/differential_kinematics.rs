// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::inverse::{Ranges, inverse};
use crate::kinematics::line::ON_THE_LINE;
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_POSE};
use crate::span::Span;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// Differential kinematics: setpoint += J⁻¹ (pose - forward(setpoint)), so that a small motion of the pose becomes a small motion of the
/// joints.
///
/// The pose may be generated online, for example by a compliance law, a joystick or a camera. The motion begins at `start` (the current
/// commanded positions) and continues from one invocation to the next, so the arm keeps its posture. No joint is commanded a step that
/// exceeds its maximum speed or leaves its range: instead, all joints take the same fraction of their steps, `behind` is the distance of
/// the tool from the pose, and `slowed` is reported; the tool catches up later. For a straight line that is known in advance, use
/// `line_planner`, which looks ahead. Faults: 1 the arm is not a chain of n joints; 2 a position is not finite, or the quaternion of the
/// pose is not a unit quaternion.
#[derive(FunctionBlock)]
pub struct DifferentialKinematics {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// commanded pose of the tool: x y z in m, quaternion w x y z
    #[input(range = "[pose]")]
    pose: [f64; 7],
    /// commanded positions of the joints at the start, rad or m
    #[input(asynchronous, sized)]
    start: [f64; 16],
    /// maximum speed of each joint
    #[input(asynchronous, default = [std::f64::consts::PI; 16], sized, range = "(0, inf)")]
    speed_max: [f64; 16],
    /// minimum position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized, range = "[-inf, inf)")]
    position_min: [f64; 16],
    /// maximum position of each joint
    #[input(asynchronous, default = [1e6; 16], sized, range = "[-inf, inf)")]
    position_max: [f64; 16],
    /// commanded positions of the joints, rad or m
    #[output(sized)]
    setpoint: [f64; 16],
    /// distance of the tool from the commanded pose, at the set-point
    #[output(unit = "m")]
    behind: f64,
    /// angle between the tool and the commanded pose, at the set-point
    #[output(unit = "rad")]
    turned: f64,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// a joint would have exceeded its maximum speed, or the pose is unreachable
    #[condition]
    slowed: Condition,
    /// the distance of the tool from the pose exceeds the preset (0: off); the value is the distance, m
    #[condition(preset = 0.0, range = "[0, inf)")]
    lost: ConditionOf<f64>,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
    /// joint positions in the previous invocation
    #[state]
    q: [f64; 16],
}

impl Step for DifferentialKinematics {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let chain = self.chain;
        let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        let (Some(pose), true) = (Pose::of(&self.pose), self.start[..n].iter().all(|q| q.is_finite())) else { return Outcome::Fault(BAD_POSE) };
        if !self.span.begun() {
            self.q = self.start;
        }
        let span_s = self.span.pass(invocation).cycle_s();
        let ranges = Ranges { min: &self.position_min[..n], max: &self.position_max[..n] };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::chain::samples::{HOME, six_joints};


    fn block(speed: f64) -> DifferentialKinematics {
        let mut start = [0.0; 16];
        start[..6].copy_from_slice(&HOME);
        let pose = six_joints().read(6).expect("a chain").posture(&HOME).tool.numbers();
        DifferentialKinematics {
            n: 6, pose, start, speed_max: [speed; 16], position_min: [-6.3; 16], position_max: [6.3; 16], setpoint: [0.0; 16], behind: 0.0, turned: 0.0,
            chain: six_joints(), slowed: Condition::new(), lost: ConditionOf::new(0.0), span: Span::default(), q: [0.0; 16],
        }
    }

    fn at(k: i64) -> Invocation {
        Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }
    }

    #[test]
    fn it_begins_where_the_joints_are_and_follows_a_pose_that_moves() {
        let mut block = block(3.0);
        for k in 0..100 {
            // A circle of 5 cm in two seconds.
            let angle = k as f64 * 0.02 * std::f64::consts::PI;
            let centre = block.pose;
            if k > 0 {
                (block.pose[0], block.pose[2]) = (centre[0] + 0.003 * angle.cos(), centre[2] + 0.003 * angle.sin());
            }
            block.slowed = Condition::new();
            assert_eq!(block.step(&at(k)), Outcome::Done);
            assert!(block.behind < 1e-6 && block.turned < 1e-6 && !block.slowed.is_reported(), "{k}: {}", block.behind);
            if k == 0 {
                assert!(block.setpoint[..6].iter().zip(&HOME).all(|(q, home)| (q - home).abs() < 1e-6));
            }
        }
    }

    #[test]
    fn a_pose_that_jumps_is_caught_up_with_at_the_speed_of_the_joints() {
        let mut block = block(0.5);
        assert_eq!(block.step(&at(0)), Outcome::Done);
        block.pose[2] += 0.1;
        block.lost = ConditionOf::new(0.05);
        let mut before = block.setpoint;
        let mut slow = 0;
        for k in 1..100 {
            (block.slowed, block.lost) = (Condition::new(), ConditionOf::new(0.05));
            assert_eq!(block.step(&at(k)), Outcome::Done);
            assert!((0..6).all(|i| (block.setpoint[i] - before[i]).abs() <= 0.5 * 0.02 * (1.0 + 1e-9)), "{k}");
            assert_eq!(block.lost.is_reported(), block.behind > 0.05);
            slow += i32::from(block.slowed.is_reported());
            before = block.setpoint;
        }
        assert!(slow > 5 && block.behind < 1e-6, "{slow} {}", block.behind);
    }

    #[test]
    fn a_range_is_not_left() {
        let mut block = block(3.0);
        block.position_max[2] = 1.6;
        assert_eq!(block.step(&at(0)), Outcome::Done);
        (block.pose[0], block.pose[2]) = (block.pose[0] + 0.2, block.pose[2] - 0.2);
        for k in 1..100 {
            assert_eq!(block.step(&at(k)), Outcome::Done);
            assert!(block.setpoint[2] <= 1.6);
        }
        assert!(block.slowed.is_reported() && block.behind > 0.01);
    }

    #[test]
    fn what_is_no_pose_is_a_fault() {
        let mut block = block(1.0);
        block.pose = [0.0; 7];
        assert_eq!(block.step(&at(0)), Outcome::Fault(BAD_POSE));
        block.n = 5;
        assert_eq!(block.step(&at(0)), Outcome::Fault(BAD_CHAIN));
    }
}
