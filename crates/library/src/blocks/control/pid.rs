// SPDX-License-Identifier: Apache-2.0
use crate::reference::Reference;
use crate::span::Span;
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// The limit is negative, the minimum effort is above the limit, or one of them is NaN.
const BAD_LIMIT: u32 = 1;
/// The anti-windup method is unknown.
const UNKNOWN_ANTI_WINDUP: u32 = 2;
/// A time constant is out of range.
const BAD_TIME: u32 = 3;

/// PID controller: effort = kp (b r - y) + ki ∫(r - y) dt + kd (c r' - y') + feedforward, from `least` and -limit to limit.
///
/// r is the reference (the set-point, or its interpolated value if `interpolation` is set), y the measured value. b and c weight the
/// set-point in the proportional and the derivative term: with c = 0, a step of the set-point causes no kick; an interpolated set-point
/// always has its full weight. The derivative is computed by differences and filtered by a lag of `derivative_time`. Anti-windup 0 stops
/// the integral if the effort is limited and the error would drive it further; 1, back-calculation, draws the integral back with
/// `tracking_time`. If `manual` is true, the effort is `manual_effort` and the integral tracks it, so that the return to automatic is
/// bumpless; a start with `manual` true in the first invocation is bumpless too. If the plant measures its rate, `joint_servo` is the
/// better choice. Source: Astrom and Hagglund, Advanced PID Control, 3.3 to 3.6 and 13.4. Range: limit, weights and derivative_time from
/// 0, tracking_time above 0. Faults: 1 the limit is below 0 or below the minimum effort; 2 the anti-windup method is not 0 (clamping) or
/// 1 (back-calculation); 3 derivative_time is negative or tracking_time is not above 0.
#[derive(FunctionBlock)]
pub struct Pid {
    /// set-point
    #[input]
    setpoint: f64,
    /// measured value
    #[input]
    measured: f64,
    /// value added to the effort: a known load, such as gravity
    #[input(asynchronous, default = 0.0, range = "[-inf, inf)")]
    feedforward: f64,
    /// control effort
    #[output]
    effort: f64,
    /// e: reference - measured
    #[output]
    error: f64,
    /// proportional gain
    #[param(default = 1.0, range = "[-inf, inf)")]
    kp: f64,
    /// integral gain, per second
    #[param(default = 0.0, range = "[-inf, inf)")]
    ki: f64,
    /// derivative gain, seconds
    #[param(default = 0.0, range = "[-inf, inf)")]
    kd: f64,
    /// maximum magnitude of the effort
    #[param(default = 1e6, range = "[0, inf)")]
    limit: f64,
    /// number of invocations over which a new set-point is reached in equal steps; 1: immediately
    #[param(default = 1, range = "[0, 1000000]")]
    interpolation: u32,
    /// |e| has exceeded the preset; the value is e; off if the preset is 0
    #[condition(preset = 0.0, range = "[0, inf)")]
    following_error: ConditionOf<f64>,
    /// true: the effort is `manual_effort`
    #[input(asynchronous, default = false)]
    manual: bool,
    /// manual effort, or the output of another controller
    #[input(asynchronous, default = 0.0, range = "[-inf, inf)")]
    manual_effort: f64,
    /// minimum effort, if other than -limit (0 for a heater)
    #[param(default = f64::NEG_INFINITY, range = "[-inf, inf)")]
    least: f64,
    /// b: weight of the set-point in the proportional term
    #[param(default = 1.0, range = "[-inf, inf)")]
    setpoint_weight: f64,
    /// c: weight of the set-point in the derivative term
    #[param(default = 0.0, range = "[-inf, inf)")]
    derivative_weight: f64,
    /// time constant of the derivative filter; 0: no filter
    #[param(default = 0.0, unit = "s", range = "[0, inf)")]
    derivative_time: f64,
    /// 0 clamping, 1 back-calculation
    #[param(default = 0, range = "[0, 1]")]
    anti_windup: u32,
    /// time constant with which back-calculation draws the integral back
    #[param(default = 1.0, unit = "s", range = "(0, inf)")]
    tracking_time: f64,
    /// state of the reference
    #[state(opaque)]
    reference: Reference,
    /// ki ∫e dt
    #[state]
    integral: f64,
    /// measured value in the previous invocation
    #[state]
    before: f64,
    /// filtered derivative
    #[state]
    rate: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
}

impl Pid {
    /// Updates the derivative c r' - y', filtered by the lag.
    fn derive(&mut self, step: f64, span_s: f64) {
        let step = if self.interpolation > 1 { step } else { self.derivative_weight * step };
        let change = step - (self.measured - self.before);
        if span_s > 0.0 {
            self.rate = match self.derivative_time {
                0.0 => change / span_s,
                time => (time * self.rate + change) / (time + span_s),
            };
        }
    }

    /// Computes the effort and the corresponding integral.
    fn act(&mut self, reference: f64, span_s: f64) {
        let proportional = self.kp * (self.setpoint_weight * reference - self.measured);
        let derivative = self.kd * self.rate;
        let least = self.least.max(-self.limit);
        let limited = |effort: f64| if effort.is_nan() { effort } else { effort.clamp(least, self.limit) };
        if self.manual {
            self.effort = limited(self.manual_effort);
            self.integral = if self.ki == 0.0 { self.integral } else { self.effort - proportional - derivative - self.feedforward };
            return;
        }
        let more = self.integral + self.ki * self.error * span_s;
        let wanted = proportional + more + derivative + self.feedforward;
        self.effort = limited(wanted);
        let excess = wanted - self.effort;
        if self.anti_windup == 1 {
            self.integral = more - excess * (span_s / self.tracking_time).min(1.0);
        } else if excess == 0.0 || excess * self.error * self.ki <= 0.0 {
            self.integral = more;
        }
    }
}

impl Step for Pid {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if !(self.limit >= 0.0 && self.least <= self.limit) {
            return Outcome::Fault(BAD_LIMIT);
        }
        if self.anti_windup > 1 {
            return Outcome::Fault(UNKNOWN_ANTI_WINDUP);
        }
        if !(self.derivative_time >= 0.0 && self.tracking_time > 0.0) {
            return Outcome::Fault(BAD_TIME);
        }
        let (reference, step) = self.reference.advance(self.setpoint, self.interpolation);
        let passed = self.span.pass(invocation);
        // The measured value has changed during the lost time; the integral has not.
        self.derive(step, passed.cycle_s() + passed.lost_s());
        self.error = reference - self.measured;
        self.act(reference, passed.used_s());
        self.before = self.measured;
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
            setpoint: 0.0,
            measured: 0.0,
            feedforward: 0.0,
            effort: 0.0,
            error: 0.0,
            kp: 1.0,
            ki: 0.0,
            kd: 0.0,
            limit: 1e6,
            interpolation: 1,
            following_error: ConditionOf::new(0.0),
            reference: Reference::default(),
            integral: 0.0,
            before: 0.0,
            rate: 0.0,
            span: Span::default(),
            manual: false,
            manual_effort: 0.0,
            least: f64::NEG_INFINITY,
            setpoint_weight: 1.0,
            derivative_weight: 0.0,
            derivative_time: 0.0,
            anti_windup: 0,
            tracking_time: 1.0,
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
