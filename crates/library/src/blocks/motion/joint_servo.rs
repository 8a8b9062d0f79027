// SPDX-License-Identifier: Apache-2.0
use crate::chatter::Chatter;
use crate::reference::{Approach, ReferenceInputs, is_bad_limit};
use crate::ripple::Ripple;
use crate::servo::Law;
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// A limit is negative or NaN, or the range is empty.
const BAD_LIMIT: u32 = 1;

/// State kept between invocations, in a single item because a block has at most 32 items.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    approach: Approach,
    /// Swing counters of the effort and of the error.
    swings: [Chatter; 2],
    ripple: Ripple,
    /// ki ∫(q_r - q) dt
    integral: f64,
}

/// Joint servo: effort = kp (q_r - q) + ki ∫(q_r - q) dt + kd (q_r' - q') + bias within ± limit; fault 1 if a limit is below 0 or the
/// range is empty.
///
/// q_r is the set-point, smoothed over `interpolation` invocations: the number of servo invocations between two set-points, so that a
/// generator at 20 ms drives a servo at 1 ms without steps in position or speed, with a delay of one and a half generator periods. q_r
/// stays within the range of the joint and its maximum speed, whatever the set-points are: these are the last limits before the physical
/// device. If releases of the block itself were skipped, q_r continues from its last position, no faster than before and no faster than
/// the set-points move. If a set-point with a nonzero `setpoint_velocity` is not followed by another in time, q_r moves past it and
/// brakes within `acceleration_max` and `jerk_max`; a set-point without a velocity is a position to hold. `bias` is the effort that holds
/// the arm in place (gravity, Coriolis and centrifugal forces), as reported by the plant or a model of it. A change of `offset` moves the
/// numbers, not the joint: q and the set-point must change with it.
#[derive(FunctionBlock)]
pub struct JointServo {
    /// commanded position
    #[input(asynchronous, unit = "rad|m")]
    setpoint: f64,
    /// speed of the set-point, if provided
    #[input(asynchronous, default = 0.0, unit = "rad/s|m/s", range = "[-inf, inf)")]
    setpoint_velocity: f64,
    /// acceleration of the set-point
    #[input(asynchronous, default = 0.0, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
    setpoint_acceleration: f64,
    /// time at which the set-point was stored, ns of the system clock
    #[input(asynchronous, default = 0, range = "[-inf, inf)")]
    setpoint_time: i64,
    /// position q
    #[input(unit = "rad|m")]
    position: f64,
    /// velocity q'
    #[input(asynchronous, default = 0.0, unit = "rad/s|m/s", range = "[-inf, inf)")]
    velocity: f64,
    /// effort that holds the arm
    #[input(asynchronous, default = 0.0, unit = "N.m|N", range = "[-inf, inf)")]
    bias: f64,
    /// offset, which is added to the readings of the joint to obtain q
    #[input(asynchronous, default = 0.0, unit = "rad|m", range = "[-inf, inf)")]
    offset: f64,
    /// true if q is known; until then, the range of q_r is meaningless and not enforced
    #[input(asynchronous, default = true)]
    homed: bool,
    /// effort applied to the joint
    #[output(unit = "N.m|N")]
    effort: f64,
    /// q_r: current commanded position of the joint
    #[output(unit = "rad|m")]
    reference: f64,
    /// q_r': current commanded speed; 0 if no set-points arrive
    #[output(unit = "rad/s|m/s")]
    reference_velocity: f64,
    /// number of invocations in which the range or the maximum speed limited q_r
    #[output]
    limited: i64,
    /// motion of q_r past the last set-point because no new one arrived in time: distance, speed, acceleration, and start time (ns of the
    /// system clock); all 0 while set-points lead
    #[output]
    braking: [f64; 4],
    /// time lost in a single gap because releases were skipped, shown for that length of time; 0 if no time was lost
    #[output(unit = "s")]
    lost: f64,
    /// current maximum of |q_r - q|: the preset of `following_error`
    #[output(unit = "rad|m")]
    error_max: f64,
    /// proportional gain
    #[param(default = 100.0, unit = "N.m/rad|N/m", range = "[0, inf)")]
    kp: f64,
    /// integral gain
    #[param(default = 0.0, unit = "N.m/rad/s|N/m/s", range = "[0, inf)")]
    ki: f64,
    /// gain of the velocity error
    #[param(default = 10.0, unit = "N.m.s/rad|N.s/m", range = "[0, inf)")]
    kd: f64,
    /// maximum magnitude of the effort
    #[param(default = 1e6, unit = "N.m|N", range = "[0, inf)")]
    limit: f64,
    /// number of invocations over which a new set-point is approached; 1: immediately
    #[param(default = 20, range = "[0, 1000000]")]
    interpolation: u32,
    /// minimum q_r
    #[param(default = -1e6, unit = "rad|m", range = "[-inf, inf)")]
    position_min: f64,
    /// maximum q_r
    #[param(default = 1e6, unit = "rad|m", range = "[-inf, inf)")]
    position_max: f64,
    /// maximum |q_r'|
    #[param(default = 1e6, unit = "rad/s|m/s", range = "[0, inf)")]
    speed_max: f64,
    /// maximum |q_r''| when catching up after lost time, or braking because set-points have stopped arriving
    #[param(default = 1e6, unit = "rad/s^2|m/s^2", range = "(0, inf)")]
    acceleration_max: f64,
    /// maximum jerk when braking
    #[param(default = 1e9, unit = "rad/s^3|m/s^3", range = "(0, inf)")]
    jerk_max: f64,
    /// true: the range is enforced only if the joint is homed
    #[param(default = false)]
    needs_home: bool,
    /// peak-to-peak ripple of q_r - q at rest that counts as `unstable`; 0: off
    #[param(default = 0.0, unit = "rad|m", range = "[0, inf)")]
    ripple_max: f64,
    /// |q_r - q| exceeds the preset; the value is q_r - q; off if the preset is 0
    #[condition(preset = 0.0, unit = "rad|m", range = "[0, inf)")]
    following_error: ConditionOf<f64>,
    /// the servo is unstable: for ten consecutive periods not caused by the reference, the effort swings from limit to limit or the error
    /// swings beyond ± half the preset of `following_error`, or the error ripples by `ripple_max` while the reference is at rest; the
    /// value is the frequency in Hz, the preset the minimum frequency that counts; off if the preset is 0
    #[condition(preset = 0.0, unit = "Hz", range = "[0, inf)")]
    unstable: ConditionOf<f64>,
    /// the time lost in a single gap exceeded the preset, s, and the joint has come to rest from its position at that time; the value is
    /// the time lost, s; off if the preset is 0
    #[condition(preset = 0.0, unit = "s", range = "[0, inf)")]
    gap: ConditionOf<f64>,
    /// state of the reference, the swings, and the integral
    #[state(opaque)]
    memory: Memory,
}

impl Step for JointServo {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if is_bad_limit(self.limit) || is_bad_limit(self.speed_max) || is_bad_limit(self.position_max - self.position_min) {
            return Outcome::Fault(BAD_LIMIT);
        }
        let range = (self.homed || !self.needs_home).then_some((self.position_min, self.position_max));
        // Without interpolation, a set-point is a position to hold.
        let time_ns = if self.interpolation > 1 { self.setpoint_time } else { 0 };
        let led = ReferenceInputs {
            setpoint: self.setpoint,
            velocity: self.setpoint_velocity,
            acceleration: self.setpoint_acceleration,
            time_ns,
            position: self.position,
            offset: self.offset,
            range,
            speed_max: self.speed_max,
            acceleration_max: self.acceleration_max,
            jerk_max: self.jerk_max,
            joint_velocity: self.velocity,
            error_max: self.following_error.preset,
            gap_max_s: self.gap.preset,
        };
        let now = self.memory.approach.advance(invocation, led, |_| self.interpolation);
        (self.reference, self.reference_velocity) = (now.reference, now.velocity);
        self.limited += i64::from(now.limited);
        self.braking = now.braking.numbers();
        self.lost = now.lost_s;
        let error = now.reference - self.position;
        let law = Law { kp: self.kp, ki: self.ki, kd: self.kd, limit: self.limit };
        self.effort = law.effort(error, self.reference_velocity - self.velocity, self.bias, now.span_s, &mut self.memory.integral);
        self.error_max = self.following_error.preset;
        if let Some(lost_s) = now.rested_s {
            self.gap.report(lost_s);
        }
        if self.following_error.preset > 0.0 && error.abs() > self.following_error.preset {
            self.following_error.report(error);
        }
        let swings = [(self.effort, self.limit), (error, 0.5 * self.following_error.preset)];
        for (chatter, (value, bound)) in self.memory.swings.iter_mut().zip(swings) {
            if let Some(frequency) = chatter.look(value, bound, self.unstable.preset, self.reference_velocity, invocation.time_ns) {
                self.unstable.report(frequency);
            }
        }
        let is_still = self.reference_velocity == 0.0;
        if let Some(frequency) = self.memory.ripple.look(error, self.ripple_max, self.unstable.preset, is_still, invocation.time_ns) {
            self.unstable.report(frequency);
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn servo() -> JointServo {
        JointServo {
            setpoint: 0.0, position: 0.0, velocity: 0.0, bias: 0.0, offset: 0.0, homed: true, effort: 0.0, reference: 0.0, reference_velocity: 0.0, limited: 0, setpoint_velocity: 0.0, setpoint_acceleration: 0.0, setpoint_time: 0, braking: [0.0; 4], lost: 0.0, error_max: 0.0, jerk_max: 1e9,
            kp: 15625.0, ki: 0.0, kd: 250.0, limit: 1e6, interpolation: 20, position_min: -1e6, position_max: 1e6, speed_max: 1e6, acceleration_max: 1e6, needs_home: false, ripple_max: 0.0,
            following_error: ConditionOf::new(0.0), unstable: ConditionOf::new(0.0), gap: ConditionOf::new(0.0), memory: Memory::default(),
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
                worst = worst.max((servo.reference - q).abs());
            }
            v += (servo.effort - 9.0) * 1e-3;
            q += v * 1e-3;
        }
        assert!(worst < 0.002, "following error {worst} rad");
        assert!((q - 1.97).abs() < 0.025, "one and a half periods behind: {q}");
    }

    #[test]
    fn it_starts_without_a_jump() {
        let mut servo = JointServo { setpoint: 0.7, position: 0.7, bias: 12.5, ..servo() };
        assert_eq!(servo.step(&Invocation::default()), Outcome::Done);
        assert_eq!(servo.effort, 12.5);
    }

    #[test]
    fn its_reference_stays_in_the_range_and_below_the_maximum_speed() {
        let mut servo = JointServo { position_max: 0.5, speed_max: 2.0, setpoint: 0.0, ..servo() };
        let mut before = 0.0;
        for k in 0..1000i64 {
            assert_eq!(servo.step(&Invocation { number: k as u64, time_ns: k * 1_000_000, now_ns: 0 }), Outcome::Done);
            assert!(servo.reference_velocity.abs() <= 2.0 + 1e-9 && servo.reference - before <= 2e-3 + 1e-12 && servo.reference <= 0.5 + 1e-12);
            (before, servo.setpoint, servo.position) = (servo.reference, 9.0, servo.reference);
        }
        assert_eq!((servo.reference, servo.reference_velocity, servo.limited), (0.5, 0.0, 999));
        let mut unknown = JointServo { position_max: 0.5, setpoint: 0.7, position: 0.7, needs_home: true, homed: false, ..self::servo() };
        for k in 0..60i64 {
            assert_eq!(unknown.step(&Invocation { number: k as u64, time_ns: k * 1_000_000, now_ns: 0 }), Outcome::Done);
            unknown.setpoint = 0.9;
        }
        assert_eq!(unknown.reference, 0.9, "before it is homed its numbers mean nothing");
        assert_eq!(JointServo { position_max: -2e6, ..self::servo() }.step(&Invocation::default()), Outcome::Fault(BAD_LIMIT));
    }

    #[test]
    fn a_servo_whose_gains_are_too_high_is_unstable() {
        // A unit inertia whose drive takes the effort one period late, pushed once. Returns the reports, and the number of times that
        // the velocity reverses.
        let found = |kd: f64, limit: f64| {
            let (mut q, mut v, mut late, mut turns) = (0.001, 0.0_f64, 0.0, Vec::new());
            let mut servo = JointServo { setpoint: 0.0, kp: 100.0, kd, limit, unstable: ConditionOf::new(5.0), ..servo() };
            for k in 0..3000i64 {
                (servo.position, servo.velocity) = (q, v);
                assert_eq!(servo.step(&Invocation { number: k as u64, time_ns: k * 1_000_000, now_ns: 0 }), Outcome::Done);
                if servo.unstable.is_reported() {
                    let all_ms = (turns[turns.len() - 1] - turns[0]) as f64;
                    return Some((servo.unstable.value, 500.0 * (turns.len() - 1) as f64 / all_ms));
                }
                let before = v;
                (v, late) = (v + late * 1e-3, servo.effort);
                q += v * 1e-3;
                if before * v < 0.0 {
                    turns.push(k);
                }
            }
            None
        };
        let (said, measured) = found(1500.0, 5.0).expect("it is unstable");
        assert!((said / measured - 1.0).abs() < 0.1 && said > 50.0, "{said} Hz, {measured} Hz");
        assert_eq!(found(100.0, 5.0), None, "it settles");
    }

    #[test]
    fn another_offset_moves_nothing() {
        let mut servo = JointServo { setpoint: 0.7, position: 0.7, ..servo() };
        assert_eq!(servo.step(&Invocation::default()), Outcome::Done);
        (servo.offset, servo.setpoint, servo.position) = (-0.5, 0.2, 0.2);
        assert_eq!(servo.step(&Invocation { number: 1, time_ns: 1_000_000, now_ns: 0 }), Outcome::Done);
        assert!(servo.effort.abs() < 1e-9 && servo.reference_velocity.abs() < 1e-9, "{} N.m", servo.effort);
    }

    #[test]
    fn it_keeps_to_its_limit_and_reports_the_error() {
        let mut servo = JointServo { setpoint: 1.0, limit: 28.0, following_error: ConditionOf::new(0.1), interpolation: 1, ..servo() };
        assert_eq!(servo.step(&Invocation::default()), Outcome::Done);
        assert_eq!((servo.effort, servo.following_error.is_reported()), (0.0, false), "it begins where the joint is");
        assert_eq!(servo.step(&Invocation { number: 1, time_ns: 1_000_000, now_ns: 0 }), Outcome::Done);
        assert_eq!((servo.effort, servo.following_error.is_reported(), servo.following_error.value), (28.0, true, 1.0));
        assert_eq!(JointServo { limit: f64::NAN, ..self::servo() }.step(&Invocation::default()), Outcome::Fault(BAD_LIMIT));
    }
}
