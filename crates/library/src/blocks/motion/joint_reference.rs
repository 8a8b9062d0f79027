// SPDX-License-Identifier: Apache-2.0
use crate::reference::{Approach, ReferenceInputs, is_bad_limit};
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// A limit is negative or NaN, or the range is empty.
const BAD_LIMIT: u32 = 1;
/// Maximum number of invocations over which a set-point is approached.
const INTERPOLATION_MAX: f64 = 1e6;

/// Reference of a joint whose drive closes the loop: goal = q_r - offset, q_r the set-point, smoothed; fault 1 if a limit is below 0 or
/// the range is empty.
///
/// q_r is that of `joint_servo`: a new set-point is approached within `period`, the time between two set-points, so that a generator at
/// 20 ms leads a drive at 2 ms without steps in position or speed, with a delay of one and a half periods. q_r stays within the range of
/// the joint and its maximum speed, and starts at the position of the joint. If releases of the block itself were skipped, q_r continues
/// from its last position, no faster than before and no faster than the set-points move. If a set-point with a nonzero
/// `setpoint_velocity` is not followed by another in time, q_r moves past it and brakes within `acceleration_max` and `jerk_max`; a
/// set-point without a velocity is a position to hold. For a drive that takes an effort instead, use `joint_servo`.
#[derive(FunctionBlock)]
pub struct JointReference {
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
    /// offset, which is added to the readings of the joint to obtain q
    #[input(asynchronous, default = 0.0, unit = "rad|m", range = "[-inf, inf)")]
    offset: f64,
    /// true if q is known; until then, the range of q_r is meaningless and not enforced
    #[input(asynchronous, default = true)]
    homed: bool,
    /// goal for the drive, in the drive's own position coordinates
    #[output(unit = "rad|m")]
    goal: f64,
    /// q_r - q
    #[output(unit = "rad|m")]
    error: f64,
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
    /// time between two set-points
    #[param(default = 0.02, unit = "s", range = "(0, inf)")]
    period: f64,
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
    /// |q_r - q| exceeds the preset; the value is q_r - q; off if the preset is 0
    #[condition(preset = 0.0, unit = "rad|m", range = "[0, inf)")]
    following_error: ConditionOf<f64>,
    /// the time lost in a single gap exceeded the preset, s, and the joint has come to rest from its position at that time; the value is
    /// the time lost, s; off if the preset is 0
    #[condition(preset = 0.0, unit = "s", range = "[0, inf)")]
    gap: ConditionOf<f64>,
    /// state of the reference
    #[state(opaque)]
    approach: Approach,
}

impl Step for JointReference {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if is_bad_limit(self.period) || is_bad_limit(self.speed_max) || is_bad_limit(self.position_max - self.position_min) {
            return Outcome::Fault(BAD_LIMIT);
        }
        let range = (self.homed || !self.needs_home).then_some((self.position_min, self.position_max));
        let led = ReferenceInputs {
            setpoint: self.setpoint,
            velocity: self.setpoint_velocity,
            acceleration: self.setpoint_acceleration,
            time_ns: self.setpoint_time,
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
        let invocations = |span_s: f64| if span_s > 0.0 { (self.period / span_s).round().clamp(1.0, INTERPOLATION_MAX) as u32 } else { 1 };
        let now = self.approach.advance(invocation, led, invocations);
        (self.reference, self.reference_velocity, self.goal) = (now.reference, now.velocity, now.reference - self.offset);
        self.limited += i64::from(now.limited);
        self.braking = now.braking.numbers();
        self.lost = now.lost_s;
        self.error = now.reference - self.position;
        self.error_max = self.following_error.preset;
        if let Some(lost_s) = now.rested_s {
            self.gap.report(lost_s);
        }
        if self.following_error.preset > 0.0 && self.error.abs() > self.following_error.preset {
            self.following_error.report(self.error);
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> JointReference {
        JointReference {
            setpoint: 0.7, position: 0.7, offset: 0.0, homed: true, goal: 0.0, error: 0.0, reference: 0.0, reference_velocity: 0.0, limited: 0, setpoint_velocity: 0.0, setpoint_acceleration: 0.0, setpoint_time: 0, braking: [0.0; 4], lost: 0.0, error_max: 0.0, jerk_max: 1e9, period: 0.02,
            position_min: -1e6, position_max: 1e6, speed_max: 1e6, acceleration_max: 1e6, needs_home: false, following_error: ConditionOf::new(0.0), velocity: 0.0, gap: ConditionOf::new(0.0), approach: Approach::default(),
        }
    }

    fn at(ms: i64) -> Invocation {
        Invocation { number: 0, time_ns: ms * 1_000_000, now_ns: 0 }
    }

    #[test]
    fn it_begins_where_the_joint_is_and_comes_to_the_setpoint() {
        let mut block = JointReference { setpoint: 0.9, speed_max: 0.5, ..reference() };
        let mut before = 0.7;
        for k in 0..400 {
            assert_eq!(block.step(&at(2 * k)), Outcome::Done);
            assert!((0.0..=1e-3 + 1e-12).contains(&(block.goal - before)), "at most 0.5 rad/s: {}", block.goal - before);
            (before, block.position) = (block.goal, block.goal);
        }
        assert_eq!((block.goal, block.reference_velocity), (0.9, 0.0));
    }

    #[test]
    fn it_approaches_a_setpoint_over_its_period_at_any_rate() {
        // From rest, the maximum speed is reached after one period: ten invocations of 2 ms, twenty of 1 ms.
        for step in [1, 2] {
            let mut block = reference();
            assert_eq!(block.step(&at(0)), Outcome::Done);
            block.setpoint = 0.8;
            let fastest = (1..100).map(|k| (block.step(&at(k * step)), block.reference_velocity, k * step).1).fold(0.0, f64::max);
            assert!((fastest - 5.0).abs() < 0.01 && block.goal == 0.8, "{fastest} rad/s, {}", block.goal);
        }
    }

    #[test]
    fn another_offset_leaves_the_goal_of_the_drive() {
        let mut block = reference();
        assert_eq!(block.step(&at(0)), Outcome::Done);
        (block.offset, block.setpoint, block.position) = (-0.5, 0.2, 0.2);
        assert_eq!(block.step(&at(1)), Outcome::Done);
        assert!((block.goal - 0.7).abs() < 1e-12 && (block.reference - 0.2).abs() < 1e-12);
    }

    #[test]
    fn it_reports_the_following_error_and_refuses_bad_limits() {
        let mut block = JointReference { setpoint: 1.0, following_error: ConditionOf::new(0.1), ..reference() };
        assert_eq!((block.step(&at(0)), block.following_error.is_reported()), (Outcome::Done, false), "it begins where the joint is");
        for k in 1..50 {
            assert_eq!(block.step(&at(k)), Outcome::Done);
        }
        assert!(block.following_error.is_reported());
        assert_eq!(JointReference { speed_max: f64::NAN, ..reference() }.step(&at(0)), Outcome::Fault(BAD_LIMIT));
    }
}
