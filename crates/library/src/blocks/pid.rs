// SPDX-License-Identifier: Apache-2.0
use crate::reference::Reference;
use crate::servo::Law;
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// The limit is negative or no number.
const BAD_LIMIT: u32 = 1;

/// PID controller: effort = kp e + ki ∫e dt + kd e' + feedforward within ± limit, with e = setpoint - measured; fault 1: a limit below 0.
///
/// e' is by differences, and of the measured value alone unless the set-point is interpolated, so a step of the set-point gives no
/// kick. The integral does not wind up at the limit. Where the plant measures its rate too, `joint_servo` is the better choice.
#[derive(FunctionBlock)]
pub struct Pid {
    /// where it is to be
    #[input]
    setpoint: f64,
    /// where it is
    #[input]
    measured: f64,
    /// what is added to the effort: the load that is known, gravity for example
    #[input(asynchronous, default = 0.0)]
    feedforward: f64,
    /// what drives it there
    #[output]
    effort: f64,
    /// e: reference - measured
    #[output]
    error: f64,
    /// proportional gain
    #[param(default = 1.0)]
    kp: f64,
    /// integral gain, per second
    #[param(default = 0.0)]
    ki: f64,
    /// derivative gain, seconds
    #[param(default = 0.0)]
    kd: f64,
    /// greatest effort either way
    #[param(default = 1e6)]
    limit: f64,
    /// invocations over which a new set-point is reached in even steps; 1: at once
    #[param(default = 1)]
    interpolation: u32,
    /// |e| is above the preset; the value is e; off where the preset is 0
    #[condition(preset = 0.0)]
    following_error: ConditionOf<f64>,
    /// where the reference is
    #[state(opaque)]
    reference: Reference,
    /// ki ∫e dt
    #[state]
    integral: f64,
    /// measured value of the invocation before
    #[state]
    before: f64,
    /// running time of the invocation before, ns; -1: there was none
    #[state(initial = -1)]
    before_ns: i64,
}

impl Step for Pid {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.limit.is_nan() || self.limit < 0.0 {
            return Outcome::Fault(BAD_LIMIT);
        }
        let (reference, step) = self.reference.advance(self.setpoint, self.interpolation);
        let first = self.before_ns < 0;
        let span_s = if first { 0.0 } else { (invocation.time_ns - self.before_ns) as f64 * 1e-9 };
        let step = if self.interpolation > 1 { step } else { 0.0 };
        let rate = if span_s > 0.0 { (step - (self.measured - self.before)) / span_s } else { 0.0 };
        self.error = reference - self.measured;
        let law = Law { kp: self.kp, ki: self.ki, kd: self.kd, limit: self.limit };
        self.effort = law.effort(self.error, rate, self.feedforward, span_s, &mut self.integral);
        (self.before, self.before_ns) = (self.measured, invocation.time_ns);
        if self.following_error.preset > 0.0 && self.error.abs() > self.following_error.preset {
            self.following_error.report(self.error);
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pid() -> Pid {
        Pid {
            setpoint: 0.0, measured: 0.0, feedforward: 0.0, effort: 0.0, error: 0.0, kp: 1.0, ki: 0.0, kd: 0.0, limit: 1e6, interpolation: 1,
            following_error: ConditionOf::new(0.0), reference: Reference::default(), integral: 0.0, before: 0.0, before_ns: -1,
        }
    }

    fn at(k: i64) -> Invocation {
        Invocation { number: k as u64, time_ns: k * 1_000_000, now_ns: 0 }
    }

    #[test]
    fn a_setpoint_step_moves_the_proportional_term_only() {
        let mut pid = Pid { kp: 10.0, kd: 3.0, feedforward: 2.0, ..pid() };
        assert_eq!(pid.step(&at(0)), Outcome::Done);
        pid.setpoint = 0.5;
        assert_eq!(pid.step(&at(1)), Outcome::Done);
        assert_eq!((pid.effort, pid.error), (7.0, 0.5));
    }

    #[test]
    fn the_derivative_opposes_motion() {
        let mut pid = Pid { kp: 0.0, kd: 0.1, ..pid() };
        for k in 0..5 {
            pid.measured = 0.002 * k as f64;
            assert_eq!(pid.step(&at(k)), Outcome::Done);
        }
        assert!((pid.effort + 0.2).abs() < 1e-12, "2 rad/s times 0.1: {}", pid.effort);
    }

    #[test]
    fn the_integral_grows_with_time() {
        let mut pid = Pid { kp: 0.0, ki: 4.0, setpoint: 1.0, ..pid() };
        for k in 0..=250 {
            assert_eq!(pid.step(&at(k)), Outcome::Done);
        }
        assert!((pid.effort - 1.0).abs() < 1e-9, "4 times 0.25 s");
    }

    #[test]
    fn it_holds_an_unstable_load_at_the_setpoint() {
        // A unit mass under a constant load of -3, 1 kHz.
        let mut pid = Pid { kp: 400.0, ki: 800.0, kd: 40.0, limit: 200.0, setpoint: 1.0, ..pid() };
        let (mut x, mut v) = (0.0, 0.0);
        for k in 0..8000 {
            pid.measured = x;
            assert_eq!(pid.step(&at(k)), Outcome::Done);
            v += (pid.effort - 3.0) * 1e-3;
            x += v * 1e-3;
        }
        assert!((x - 1.0).abs() < 1e-4 && v.abs() < 1e-4, "{x}, {v}");
    }

    #[test]
    fn a_following_error_is_reported_with_its_value() {
        let mut pid = Pid { setpoint: -0.3, following_error: ConditionOf::new(0.2), ..pid() };
        assert_eq!(pid.step(&at(0)), Outcome::Done);
        assert!(pid.following_error.is_reported());
        assert_eq!(pid.following_error.value, -0.3);
        let mut off = Pid { setpoint: 9.0, ..self::pid() };
        assert_eq!(off.step(&at(0)), Outcome::Done);
        assert!(!off.following_error.is_reported());
        assert_eq!(Pid { limit: -1.0, ..self::pid() }.step(&at(0)), Outcome::Fault(BAD_LIMIT));
    }
}
