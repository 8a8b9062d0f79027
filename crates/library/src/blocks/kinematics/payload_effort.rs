// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::{BAD_CHAIN, BAD_LIMIT, BAD_POSE};
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Payload effort: effort = -J_c(q)ᵀ m g, the joint efforts that hold a mass m with its centre at c in the flange frame.
///
/// Only the weight of the mass is compensated; its inertia is left to the servo. The mass is added and removed at `rate`, so that the
/// efforts do not jump. Source: Lynch and Park, *Modern Robotics*, 2017, section 5.2 (statics). Faults: 1 the arm is not a chain of n
/// joints; 2 a joint position, the centre or gravity is not finite; 3 the mass is negative or the rate is not above 0.
#[derive(FunctionBlock)]
pub struct PayloadEffort {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// joint positions, rad or m
    #[input(asynchronous, sized)]
    q: [f64; 16],
    /// efforts that hold the payload, N.m or N
    #[output(sized)]
    effort: [f64; 16],
    /// currently compensated mass
    #[output(unit = "kg")]
    held: f64,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// mass of the payload
    #[param(default = 0.0, unit = "kg", range = "[0, 100000]")]
    mass: f64,
    /// centre of mass in the frame of the flange, m
    #[param(default = [0.0; 3], range = "[-100, 100]")]
    centre: [f64; 3],
    /// gravity in the frame of the poses, m/s^2
    #[param(default = [0.0, 0.0, -9.81], range = "[-1000, 1000]")]
    gravity: [f64; 3],
    /// rate at which the mass is added and removed, kg/s
    #[param(default = 10.0, range = "(0, inf)")]
    rate: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
}

impl Step for PayloadEffort {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        // The centre replaces the tool: the efforts are those of a force at the centre.
        let [x, y, z] = self.centre;
        let chain = Chain { tool: [x, y, z, 1.0, 0.0, 0.0, 0.0], ..self.chain };
        if !self.q[..n].iter().chain(&self.centre).chain(&self.gravity).all(|x| x.is_finite()) {
            return Outcome::Fault(BAD_POSE);
        }
        let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        if !(self.mass >= 0.0 && self.mass.is_finite() && self.rate > 0.0) {
            return Outcome::Fault(BAD_LIMIT);
        }
        let most = self.rate * self.span.used(invocation);
        self.held += (self.mass - self.held).clamp(-most, most);
        let rows = arm.jacobian(&arm.posture(&self.q[..n]));
        for (effort, row) in self.effort.iter_mut().zip(&rows) {
            let lift: f64 = row.iter().zip(&self.gravity).map(|(j, g)| j * g).sum();
            *effort = -lift * self.held;
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::chain::samples::planar;

    fn block() -> PayloadEffort {
        PayloadEffort {
            n: 2, q: [0.0; 16], effort: [0.0; 16], held: 0.0, chain: planar(), mass: 2.0, centre: [0.1, 0.0, 0.0], gravity: [0.0, -10.0, 0.0],
            rate: 10.0, span: Span::default(),
        }
    }

    fn at(ms: i64) -> Invocation {
        Invocation { number: 0, time_ns: ms * 1_000_000, now_ns: 0 }
    }

    #[test]
    fn a_stretched_arm_holds_weight_times_distance() {
        let mut block = block();
        assert_eq!((block.step(&at(0)), block.effort[0]), (Outcome::Done, 0.0));
        assert_eq!(block.step(&at(100)), Outcome::Done);
        assert!((block.held - 1.0).abs() < 1e-12, "taken on at its rate");
        assert_eq!(block.step(&at(900)), Outcome::Done);
        // 20 N at 1.6 m and at 0.6 m.
        assert!((block.effort[0] - 32.0).abs() < 1e-9 && (block.effort[1] - 12.0).abs() < 1e-9 && block.held == 2.0);
        block.q[0] = std::f64::consts::FRAC_PI_2;
        assert_eq!(block.step(&at(920)), Outcome::Done);
        assert!(block.effort[0].abs() < 1e-9, "upright nothing is lifted");
    }

    #[test]
    fn what_is_no_payload_is_a_fault() {
        assert_eq!(PayloadEffort { mass: -1.0, ..block() }.step(&at(0)), Outcome::Fault(BAD_LIMIT));
        assert_eq!(PayloadEffort { chain: Chain::NOTHING, ..block() }.step(&at(0)), Outcome::Fault(BAD_CHAIN));
        assert_eq!(PayloadEffort { centre: [f64::NAN; 3], ..block() }.step(&at(0)), Outcome::Fault(BAD_POSE));
    }
}
