// SPDX-License-Identifier: Apache-2.0
use crate::reference::Reference;
use crate::servo::Law;
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// The limit is negative or no number.
const BAD_LIMIT: u32 = 1;

/// Joint servo: effort = kp (q_r - q) + ki ∫(q_r - q) dt + kd (q_r' - q') + bias within ± limit; fault 1: a limit below 0.
///
/// q_r is the set-point, approached in even steps over `interpolation` invocations: as many as the servo makes between two
/// set-points, so that a generator at 20 ms drives a servo at 1 ms without stairs, at a delay of one generator period. `bias` is the
/// effort that holds the arm where it is (gravity, Coriolis and centrifugal force), as the plant or a model of it tells.
#[derive(FunctionBlock)]
pub struct JointServo {
    /// position that is commanded
    #[input(asynchronous, unit = "rad")]
    setpoint: f64,
    /// position q
    #[input(unit = "rad")]
    position: f64,
    /// velocity q'
    #[input(asynchronous, default = 0.0, unit = "rad/s")]
    velocity: f64,
    /// effort that holds the arm
    #[input(asynchronous, default = 0.0, unit = "N.m")]
    bias: f64,
    /// effort at the joint
    #[output(unit = "N.m")]
    effort: f64,
    /// q_r - q
    #[output(unit = "rad")]
    error: f64,
    /// proportional gain
    #[param(default = 100.0, unit = "N.m/rad")]
    kp: f64,
    /// integral gain
    #[param(default = 0.0, unit = "N.m/rad/s")]
    ki: f64,
    /// gain of the velocity error
    #[param(default = 10.0, unit = "N.m.s/rad")]
    kd: f64,
    /// greatest effort either way
    #[param(default = 1e6, unit = "N.m")]
    limit: f64,
    /// invocations over which a new set-point is reached; 1: at once
    #[param(default = 20)]
    interpolation: u32,
    /// |q_r - q| is above the preset; the value is q_r - q; off where the preset is 0
    #[condition(preset = 0.0, unit = "rad")]
    following_error: ConditionOf<f64>,
    /// where the reference is
    #[state(opaque)]
    reference: Reference,
    /// ki ∫(q_r - q) dt
    #[state]
    integral: f64,
    /// running time of the invocation before, ns; -1: there was none
    #[state(initial = -1)]
    before_ns: i64,
}

impl Step for JointServo {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.limit.is_nan() || self.limit < 0.0 {
            return Outcome::Fault(BAD_LIMIT);
        }
        let (reference, step) = self.reference.advance(self.setpoint, self.interpolation);
        let span_s = if self.before_ns < 0 { 0.0 } else { (invocation.time_ns - self.before_ns) as f64 * 1e-9 };
        self.before_ns = invocation.time_ns;
        let moving = self.interpolation > 1 && span_s > 0.0;
        let rate = if moving { step / span_s } else { 0.0 } - self.velocity;
        self.error = reference - self.position;
        let law = Law { kp: self.kp, ki: self.ki, kd: self.kd, limit: self.limit };
        self.effort = law.effort(self.error, rate, self.bias, span_s, &mut self.integral);
        if self.following_error.preset > 0.0 && self.error.abs() > self.following_error.preset {
            self.following_error.report(self.error);
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn servo() -> JointServo {
        JointServo {
            setpoint: 0.0, position: 0.0, velocity: 0.0, bias: 0.0, effort: 0.0, error: 0.0, kp: 15625.0, ki: 0.0, kd: 250.0, limit: 1e6,
            interpolation: 20, following_error: ConditionOf::new(0.0), reference: Reference::default(), integral: 0.0, before_ns: -1,
        }
    }

    #[test]
    fn it_follows_a_staircase_of_20_ms_closely() {
        // A unit inertia under a load that the bias compensates, at 1 rad/s: set-points every 20 ms.
        let (mut q, mut v) = (0.0, 0.0);
        let mut servo = servo();
        let mut worst: f64 = 0.0;
        for k in 0..2000i64 {
            servo.setpoint = (k / 20) as f64 * 0.02;
            (servo.position, servo.velocity, servo.bias) = (q, v, 9.0);
            assert_eq!(servo.step(&Invocation { number: k as u64, time_ns: k * 1_000_000, now_ns: 0 }), Outcome::Done);
            if k > 200 {
                worst = worst.max(servo.error.abs());
            }
            v += (servo.effort - 9.0) * 1e-3;
            q += v * 1e-3;
        }
        assert!(worst < 0.002, "following error {worst} rad");
        assert!((q - 1.98).abs() < 0.025, "a period behind: {q}");
    }

    #[test]
    fn it_starts_without_a_jump() {
        let mut servo = JointServo { setpoint: 0.7, position: 0.7, bias: 12.5, ..servo() };
        assert_eq!(servo.step(&Invocation::default()), Outcome::Done);
        assert_eq!(servo.effort, 12.5);
    }

    #[test]
    fn it_keeps_to_its_limit_and_reports_the_error() {
        let mut servo = JointServo { setpoint: 1.0, limit: 28.0, following_error: ConditionOf::new(0.1), ..servo() };
        assert_eq!(servo.step(&Invocation::default()), Outcome::Done);
        assert_eq!((servo.effort, servo.following_error.is_reported(), servo.following_error.value), (28.0, true, 1.0));
        assert_eq!(JointServo { limit: f64::NAN, ..self::servo() }.step(&Invocation::default()), Outcome::Fault(BAD_LIMIT));
    }
}
