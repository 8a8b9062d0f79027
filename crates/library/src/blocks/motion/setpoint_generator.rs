// SPDX-License-Identifier: Apache-2.0
use crate::profile::{COEFFICIENTS, duration_s, evaluate, joints, number};
use crate::span::Span;
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// There is no planned motion: the planner has not run.
const NO_PLAN: u32 = 1;
/// The motion was planned for a different number of joints.
const OTHER_SIZE: u32 = 2;

/// Set-point generator: setpoint = q(t) of a planned motion, t being the running time since the plan was first seen.
///
/// Running time stops while the verb is suspended, and time lost because releases were skipped does not count. The output `complete` and
/// the condition `finished` are reported in the invocation that stores the last set-point, which is exactly the goal, never before. A new
/// plan, identified by its number, is executed from its beginning. Faults: 1 the planner has not run; 2 the motion was planned for a
/// different number of joints.
#[derive(FunctionBlock)]
pub struct SetpointGenerator {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// planned motion
    #[input(asynchronous)]
    coefficients: [f64; COEFFICIENTS],
    /// commanded positions of the joints
    #[output(sized, unit = "rad|m")]
    setpoint: [f64; 16],
    /// commanded speed at the set-point
    #[output(sized, unit = "rad/s|m/s")]
    velocity: [f64; 16],
    /// true if the last setpoint has been stored
    #[output]
    complete: bool,
    /// time by which the setpoints are ahead
    #[param(default = 0.0, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// the last setpoint has been stored
    #[condition]
    finished: Condition,
    /// number of the plan being executed
    #[state]
    plan: f64,
    /// running time at the start of the plan, plus the time lost since, ns
    #[state]
    begun_ns: i64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
}

impl Step for SetpointGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let plan = number(&self.coefficients);
        if plan < 1.0 {
            return Outcome::Fault(NO_PLAN);
        }
        if joints(&self.coefficients) != self.n as usize {
            return Outcome::Fault(OTHER_SIZE);
        }
        let passed = self.span.pass(invocation);
        self.begun_ns += passed.lost_ns;
        if plan != self.plan {
            (self.plan, self.begun_ns) = (plan, invocation.time_ns);
        }
        let n = self.n as usize;
        let time_s = (invocation.time_ns - self.begun_ns) as f64 * 1e-9 + self.lead;
        evaluate(&self.coefficients, time_s, &mut self.setpoint[..n], &mut self.velocity[..n]);
        self.complete = time_s >= duration_s(&self.coefficients);
        if self.complete {
            self.finished.report();
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::{Coefficients, Limits, plan};

    const LIMITS: Limits = Limits { speed: 1.0, acceleration: 2.0, jerk: 8.0 };

    fn generator(coefficients: Coefficients) -> SetpointGenerator {
        SetpointGenerator {
            n: 2, coefficients, setpoint: [0.0; 16], velocity: [0.0; 16], complete: false, lead: 0.0, finished: Condition::new(), plan: 0.0, begun_ns: 0, span: Span::default(),
        }
    }

    fn at(ms: i64) -> Invocation {
        Invocation { number: 0, time_ns: ms * 1_000_000, now_ns: 0 }
    }

    #[test]
    fn it_begins_where_it_is_and_finishes_at_the_goal() {
        let mut block = generator(plan(1.0, &[1.0, 2.0], &[4.0, 0.5], &[LIMITS; 2]));
        let mut ms = 40;
        assert_eq!(block.step(&at(ms)), Outcome::Done);
        assert_eq!((block.setpoint[0], block.setpoint[1], block.complete), (1.0, 2.0, false));
        while !block.finished.is_reported() {
            ms += 20;
            assert_eq!(block.step(&at(ms)), Outcome::Done);
            assert_eq!(block.complete, block.setpoint[..2] == [4.0, 0.5], "finished with the last setpoint, at {ms} ms");
        }
        // 3.75 s by the textbook, rounded up to a multiple of 20 ms.
        assert_eq!(ms, 40 + 3760);
    }

    #[test]
    fn a_new_plan_starts_at_its_own_beginning() {
        let mut block = generator(plan(1.0, &[0.0, 0.0], &[1.0, 1.0], &[LIMITS; 2]));
        assert_eq!(block.step(&at(0)), Outcome::Done);
        assert_eq!(block.step(&at(5000)), Outcome::Done);
        assert!(block.complete);
        block.coefficients = plan(2.0, &[1.0, 1.0], &[0.0, 0.0], &[LIMITS; 2]);
        assert_eq!(block.step(&at(5020)), Outcome::Done);
        assert_eq!((block.setpoint[0], block.complete), (1.0, false));
    }

    #[test]
    fn without_a_plan_nothing_is_stored() {
        assert_eq!(generator([0.0; COEFFICIENTS]).step(&at(0)), Outcome::Fault(NO_PLAN));
        assert_eq!(generator(plan(1.0, &[0.0], &[1.0], &[LIMITS])).step(&at(0)), Outcome::Fault(OTHER_SIZE));
    }
}
