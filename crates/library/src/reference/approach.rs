// SPDX-License-Identifier: Apache-2.0
//! Reference of a joint from one invocation to the next: its set-points, lost time, and braking after a gap.

use super::{Bounds, Braking, Lead, ReferenceInputs, Spline, WARY};
use crate::online::State;
use crate::span::{ElapsedTime, Span};
use opengpac::Invocation;

/// Reference of a joint: its smoothed set-points, kept within its range and its maximum speed, and unaffected by changes of its zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Approach {
    spline: Spline,
    lead: Lead,
    offset_before: f64,
    /// Reference minus position in the previous invocation.
    error_before: f64,
    span: Span,
    gap: Gap,
}

/// Last gap, remembered for as long as it lasted: an error that occurs during this time is attributed to the gap.
#[derive(Clone, Copy, Debug, Default)]
struct Gap {
    lost_s: f64,
    left_s: f64,
}

/// Result of advancing a reference.
#[derive(Clone, Copy, Debug)]
pub struct ApproachResult {
    pub reference: f64,
    /// Speed of the reference, per second; 0 without interpolation.
    pub velocity: f64,
    /// True if a bound limited the reference.
    pub limited: bool,
    /// Duration of one cycle, s; 0 in the first.
    pub span_s: f64,
    /// Time lost in the last gap, s; 0 if there was none, or if more time has elapsed since than it lasted.
    pub lost_s: f64,
    /// Distance and motion past the last set-point, if the servo brakes because no new one arrived in time.
    pub braking: Braking,
    /// Time lost, s, in the invocation in which the reference has come to rest because the time lost in a single gap exceeded the
    /// maximum.
    pub rested_s: Option<f64>,
}

impl Approach {
    /// Advances by one cycle, regardless of the time lost before. In the first invocation, the reference starts at the joint, whatever
    /// the commanded position. `interpolation` returns the number of invocations over which a new set-point is approached, given the time
    /// between two invocations. If the time lost exceeds `gap_max_s`, the reference brakes from the position of the joint at that time.
    pub fn advance(&mut self, invocation: &Invocation, led: ReferenceInputs, interpolation: impl FnOnce(f64) -> u32) -> ApproachResult {
        let first = !self.span.begun();
        let passed = self.span.pass(invocation);
        let span_s = passed.used_s();
        if passed.is_gap() {
            self.spline.catch_up((passed.lost_ns / passed.cycle_ns.max(1)) as f64);
        }
        if first {
            self.spline = Spline::at(led.position);
            self.lead.begin(&led);
        } else if led.offset != self.offset_before {
            self.spline.shift(led.offset - self.offset_before);
            self.lead.shift(led.offset - self.offset_before, &led);
        }
        self.offset_before = led.offset;
        let (position_min, position_max) = led.range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let bounds = Bounds { position_min, position_max, step_max: led.speed_max * span_s, change_max: led.acceleration_max * span_s * span_s };
        let interpolation = interpolation(span_s);
        let lost_s = self.gap.pass(passed);
        if !first && interpolation > 1 && self.is_left(passed, &led) {
            self.leave(&led, passed.cycle_s(), interpolation, lost_s.max(passed.lost_s()), invocation.now_ns);
        }
        let velocity = if span_s > 0.0 { self.spline.speed / span_s } else { 0.0 };
        let next = self.lead.next(&led, interpolation, passed.cycle_s(), velocity, invocation.now_ns);
        self.spline.declared = if led.velocity.is_finite() { led.velocity.abs() * passed.cycle_s() } else { 0.0 };
        self.spline.heading = next.velocity * passed.cycle_s();
        self.spline.apart = if span_s > 0.0 { next.apart_s / passed.cycle_s() } else { 0.0 };
        if next.is_late {
            self.spline.catch_up_with(led.velocity * passed.cycle_s());
        } else if next.is_return {
            self.spline.wary = WARY;
        }
        let (reference, step, limited) = self.spline.advance(next.position, interpolation, bounds);
        self.error_before = reference - led.position;
        let moving = interpolation > 1 && span_s > 0.0;
        let stands_still = led.joint_velocity.abs() <= STILL_S * led.acceleration_max;
        let rested_s = if self.spline.is_there() { self.lead.rested(stands_still) } else { None };
        ApproachResult { reference, velocity: if moving { step / span_s } else { 0.0 }, limited, span_s, lost_s, braking: self.lead.braking(), rested_s }
    }

    /// Returns true if the time lost exceeds the maximum, or if the joint has strayed too far in a shorter gap. This also applies for a
    /// short time after a gap, because the first readings may be from before it.
    fn is_left(&self, passed: ElapsedTime, led: &ReferenceInputs) -> bool {
        let is_beyond = passed.lost_s() > led.gap_max_s && !self.rests_in_place(led);
        let is_recent = passed.is_gap() || (self.lead.is_alone() && self.gap.since_s() < READING_S);
        let is_astray = led.error_max > 0.0 && (self.spline.value - led.position).abs() > led.error_max;
        led.gap_max_s > 0.0 && (is_beyond || (is_recent && is_astray))
    }

    /// Returns true if nothing moved before the gap and the joint is still in place.
    fn rests_in_place(&self, led: &ReferenceInputs) -> bool {
        let moved = (self.spline.value - led.position - self.error_before).abs();
        self.spline.is_there() && self.lead.is_at_rest() && (led.error_max == 0.0 || moved <= IN_PLACE * led.error_max)
    }

    /// Starts at the position and speed of the joint, and brakes. An earlier error of the reference is kept as far as the joint still has
    /// it, so that the effort that holds the joint has no step.
    fn leave(&mut self, led: &ReferenceInputs, cycle_s: f64, interpolation: u32, lost_s: f64, now_ns: i64) {
        let before = if self.error_before.is_finite() { self.error_before } else { 0.0 };
        let kept = (self.spline.value - led.position).clamp(before.min(0.0), before.max(0.0));
        let velocity = if led.joint_velocity.is_finite() { led.joint_velocity.clamp(-led.speed_max, led.speed_max) } else { 0.0 };
        self.spline = Spline { speed: velocity * cycle_s, ..Spline::at(led.position + kept) };
        // The reference lags one and a half periods behind its set-points.
        let ahead = velocity * cycle_s * f64::from(interpolation) * 1.5;
        self.lead.leave(led, State { position: self.spline.value + ahead, velocity, acceleration: 0.0 }, interpolation, lost_s, now_ns);
    }
}

/// Fraction of the maximum following error by which a joint at rest may have moved in a gap, because readings are noisy.
const IN_PLACE: f64 = 0.1;
/// Time within which a joint that counts as stationary could stop within its acceleration, s. Allows for noise in the readings of its
/// speed.
const STILL_S: f64 = 0.02;
/// Time after a gap in which a device may still return a reading from before it, s.
const READING_S: f64 = 0.1;

impl Gap {
    /// Advances by one cycle. Returns the time lost in the last gap, s; 0 if more time has elapsed since the gap than it lasted.
    fn pass(&mut self, passed: ElapsedTime) -> f64 {
        if passed.is_gap() {
            *self = Gap { lost_s: passed.lost_s(), left_s: passed.lost_s() };
        } else if self.left_s > 0.0 {
            self.left_s -= passed.used_s();
        }
        if self.left_s > 0.0 { self.lost_s } else { 0.0 }
    }

    /// Returns the time since the last gap, s, until it exceeds the length of the gap.
    fn since_s(&self) -> f64 {
        self.lost_s - self.left_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Maximum of the speed, of the acceleration and of the lag behind the set-points, and the end position of a reference.
    struct Ride {
        speed: f64,
        acceleration: f64,
        lag: f64,
        end: f64,
    }

    /// Runs a servo at 1 ms that is stalled from `at` for `lost` ms, while its set-points continue: every 20 ms, at `acceleration` up to
    /// `speed`, for 1.4 s at that speed, and to rest in the same way.
    fn stalled(at: u64, lost: u64, speed: f64, acceleration: f64, declares: bool) -> Ride {
        let mut approach = Approach::default();
        let (mut before, mut rate) = (0.0, 0.0);
        let mut ride = Ride { speed: 0.0, acceleration: 0.0, lag: 0.0, end: 0.0 };
        let ramp_s = speed / acceleration;
        let (ramp, whole_s) = (speed * ramp_s / 2.0, 2.0 * ramp_s + 1.4);
        for k in 0..8000u64 {
            let number = if k > at { k + lost } else { k };
            let t = (number / 20 * 20) as f64 * 1e-3;
            let left = (whole_s - t).max(0.0);
            let (setpoint, velocity, change) = if t < ramp_s {
                (acceleration / 2.0 * t * t, acceleration * t, acceleration)
            } else if t < ramp_s + 1.4 {
                (ramp + speed * (t - ramp_s), speed, 0.0)
            } else {
                (2.0 * ramp + 1.4 * speed - acceleration / 2.0 * left * left, acceleration * left, if left > 0.0 { -acceleration } else { 0.0 })
            };
            let limits = ReferenceInputs { speed_max: 3.0, acceleration_max: 5.0, jerk_max: 50.0, ..ReferenceInputs::default() };
            let made_ns = (t * 1e9) as i64 + 1;
            let led = if declares {
                ReferenceInputs { setpoint, velocity, acceleration: change, time_ns: made_ns, ..limits }
            } else {
                ReferenceInputs { setpoint, ..limits }
            };
            let now = approach.advance(&Invocation { number, time_ns: number as i64 * 1_000_000, now_ns: 0 }, led, |_| 20).reference;
            let new_rate = (now - before) / 1e-3;
            ride.acceleration = ride.acceleration.max((new_rate - rate).abs() / 1e-3);
            (ride.speed, ride.lag, ride.end) = (ride.speed.max(new_rate), ride.lag.max(setpoint - now), now);
            (before, rate) = (now, new_rate);
        }
        ride
    }

    #[test]
    fn a_servo_that_stood_still_catches_up_at_the_speed_asked_for() {
        let motions = [(0.3, 0.5), (1.0, 2.0), (1.0, 5.0), (2.5, 4.0)];
        for ((speed, acceleration), declares) in motions.into_iter().flat_map(|motion| [(motion, true), (motion, false)]) {
            let end = speed * speed / acceleration + 1.4 * speed;
            for lost in [0, 3, 5, 17, 50, 100, 300, 1000, 3000] {
                for at in [30, 200, 400, 700, 1210, 1900, 2300] {
                    let ride = stalled(at, lost, speed, acceleration, declares);
                    let place = format!("after {lost} ms at {at} ms, at {speed} rad/s and {acceleration} rad/s², declared: {declares}");
                    assert!(ride.speed <= speed * (1.0 + 1e-6), "{} rad/s {place}", ride.speed);
                    assert!(ride.acceleration <= 5.0 * (1.0 + 1e-6), "{} rad/s² {place}", ride.acceleration);
                    // The last set-point is less than one period old, and the reference is one and a half periods behind it. If it declares
                    // no speed, the reference keeps the distance within which it can stop at it.
                    let stopping = if declares { 0.0 } else { speed * speed / 10.0 };
                    let most = stopping + speed * (0.001 * lost as f64 + 0.04);
                    assert!(ride.lag <= most * (1.0 + 1e-6), "{} rad behind, of {most} rad, {place}", ride.lag);
                    assert!((ride.end - end).abs() < 1e-9, "{} rad {place}", ride.end);
                }
            }
        }
    }

    /// Runs a servo at 1 ms whose set-points at 0.3 rad/s stop arriving for `late` ms from `at` ms on, and then resume where they
    /// stopped. Returns the maximum speed, the maximum acceleration, and the end position.
    fn forsaken(at: u64, late: u64) -> (f64, f64, f64) {
        let mut approach = Approach::default();
        let (mut before, mut rate, mut fastest, mut hardest) = (0.0, 0.0, 0.0f64, 0.0f64);
        // The release of each set-point in its own time, and when it comes: at a release of 20 ms, or late, and the next one at its release again.
        let (mut own, mut led) = (0u64, ReferenceInputs { speed_max: 3.0, acceleration_max: 5.0, jerk_max: 50.0, ..ReferenceInputs::default() });
        let mut due = true;
        for k in 0..8000u64 {
            due |= k % 20 == 0;
            if due && !(at..at + late).contains(&k) {
                let t = own as f64 * 0.02;
                let left = (2.6 - t).max(0.0);
                (led.setpoint, led.velocity, led.acceleration) = match t {
                    t if t < 0.6 => (0.25 * t * t, 0.5 * t, 0.5),
                    t if t < 2.0 => (0.09 + 0.3 * (t - 0.6), 0.3, 0.0),
                    _ => (0.6 - 0.25 * left * left, 0.5 * left, if left > 0.0 { -0.5 } else { 0.0 }),
                };
                led.time_ns = k as i64 * 1_000_000 + 1;
                (own, due) = (own + 1, false);
            }
            let at_ns = k as i64 * 1_000_000;
            let now = approach.advance(&Invocation { number: k, time_ns: at_ns, now_ns: at_ns + 2 }, led, |_| 20).reference;
            let speed = (now - before) / 1e-3;
            (fastest, hardest) = (fastest.max(speed.abs()), hardest.max((speed - rate).abs() / 1e-3));
            (before, rate) = (now, speed);
        }
        (fastest, hardest, before)
    }

    #[test]
    fn setpoints_that_stayed_away_are_followed_at_the_speed_asked_for() {
        for late in [0, 1, 2, 5, 10, 15, 19, 20, 21, 25, 30, 40, 55, 70, 100, 200, 450, 1000] {
            for at in [30, 200, 700, 707, 1210, 1911, 2300] {
                let (fastest, hardest, end) = forsaken(at, late);
                // One that is hardly later than the next one is due is made up for, so that joints stay on their way together.
                let most = if late < 30 { 0.345 } else { 0.3 * (1.0 + 1e-6) };
                assert!(fastest <= most, "{fastest} rad/s after {late} ms at {at} ms");
                assert!(hardest <= 5.0 * (1.0 + 1e-6), "{hardest} rad/s² after {late} ms at {at} ms");
                assert!((end - 0.6).abs() < 1e-9, "{end} rad after {late} ms at {at} ms");
            }
        }
    }

    /// Runs a servo at 1 ms whose set-points at 0.3 rad/s are delayed in transit for `late` ms, from `at` ms on, although their generator
    /// continues. Then an old set-point arrives, generated `old` ms after `at`, and 3 ms later the newest one. Returns the maximum speed,
    /// the maximum acceleration, and the end position.
    fn held_up(at: u64, late: u64, old: u64) -> (f64, f64, f64) {
        let mut approach = Approach::default();
        let (mut before, mut rate, mut fastest, mut hardest) = (0.0, 0.0, 0.0f64, 0.0f64);
        for k in 0..8000u64 {
            let came = match k {
                k if k < at => k,
                k if k < at + late => at,
                k if k < at + late + 3 => at + old,
                k => k,
            };
            let made = came / 20 * 20;
            let t = made as f64 * 1e-3;
            let left = (2.6 - t).max(0.0);
            let (setpoint, velocity, acceleration) = match t {
                t if t < 0.6 => (0.25 * t * t, 0.5 * t, 0.5),
                t if t < 2.0 => (0.09 + 0.3 * (t - 0.6), 0.3, 0.0),
                _ => (0.6 - 0.25 * left * left, 0.5 * left, if left > 0.0 { -0.5 } else { 0.0 }),
            };
            let limits = ReferenceInputs { speed_max: 3.0, acceleration_max: 5.0, jerk_max: 50.0, ..ReferenceInputs::default() };
            let led = ReferenceInputs { setpoint, velocity, acceleration, time_ns: made as i64 * 1_000_000 + 1, ..limits };
            let at_ns = k as i64 * 1_000_000;
            let now = approach.advance(&Invocation { number: k, time_ns: at_ns, now_ns: at_ns + 2 }, led, |_| 20).reference;
            let speed = (now - before) / 1e-3;
            (fastest, hardest) = (fastest.max(speed.abs()), hardest.max((speed - rate).abs() / 1e-3));
            (before, rate) = (now, speed);
        }
        (fastest, hardest, before)
    }

    #[test]
    fn setpoints_that_come_in_a_burst_are_followed_at_the_speed_asked_for() {
        for late in [70, 100, 200, 330, 450, 1000] {
            for at in [200, 700, 707, 1210, 1911] {
                for old in [20, 40, late / 2] {
                    let (fastest, hardest, end) = held_up(at, late, old);
                    assert!(fastest <= 0.3 * (1.0 + 1e-6), "{fastest} rad/s after {late} ms at {at} ms, the first of {old} ms");
                    assert!(hardest <= 5.0 * (1.0 + 1e-6), "{hardest} rad/s² after {late} ms at {at} ms, the first of {old} ms");
                    assert!((end - 0.6).abs() < 1e-9, "{end} rad after {late} ms at {at} ms, the first of {old} ms");
                }
            }
        }
    }

    #[test]
    fn lost_time_is_told_for_as_long_as_it_was() {
        let mut approach = Approach::default();
        let mut at = |number: u64| {
            let invocation = Invocation { number, time_ns: number as i64 * 1_000_000, now_ns: 0 };
            approach.advance(&invocation, ReferenceInputs { speed_max: 3.0, acceleration_max: 5.0, ..ReferenceInputs::default() }, |_| 20).lost_s
        };
        assert_eq!((at(0), at(1), at(3)), (0.0, 0.0, 0.0), "a cycle too late is no gap");
        let told: Vec<f64> = (54..110).map(&mut at).collect();
        let (during, after) = told.split_at(50);
        assert!(during.iter().all(|lost| (lost - 0.05).abs() < 1e-12), "{during:?}");
        assert!(after[1..].iter().all(|lost| *lost == 0.0), "{after:?}");
    }

    #[test]
    fn a_servo_that_is_always_a_little_late_follows_as_before() {
        let mut approach = Approach::default();
        let mut now = 0.0;
        for k in 0..2000u64 {
            let number = 2 * k;
            let led = ReferenceInputs { setpoint: (number / 20) as f64 * 0.006, speed_max: 3.0, acceleration_max: 5.0, ..ReferenceInputs::default() };
            now = approach.advance(&Invocation { number, time_ns: number as i64 * 1_000_000, now_ns: 0 }, led, |_| 10).reference;
        }
        assert!((now - 0.3 * 3.97).abs() < 0.01, "{now}");
    }

    /// Runs a servo that leads a joint at 0.3 rad/s, is stalled for 0.7 s, and then finds the joint at `position`, moving at `velocity`;
    /// the joint follows afterwards. Returns the references, and the times at which the servo reported rest.
    fn left(position: f64, velocity: f64) -> (Vec<f64>, Vec<(u64, f64)>) {
        let (mut approach, mut references, mut told) = (Approach::default(), Vec::new(), Vec::new());
        let (mut joint, mut speed) = (0.0, velocity);
        for k in 0..2000u64 {
            let number = if k < 1000 { k } else { k + 700 };
            let ms = |number: u64| number as i64 * 1_000_000;
            let knot = number / 20 * 20;
            let led = ReferenceInputs {
                setpoint: knot as f64 * 3e-4,
                velocity: 0.3,
                time_ns: ms(knot) + 1,
                position: if k == 1000 { position } else { joint },
                speed_max: 3.0,
                acceleration_max: 5.0,
                jerk_max: 50.0,
                joint_velocity: speed,
                error_max: 0.05,
                gap_max_s: 0.5,
                ..ReferenceInputs::default()
            };
            let now = approach.advance(&Invocation { number, time_ns: ms(number), now_ns: ms(number) }, led, |_| 20);
            joint = now.reference;
            if k >= 1000 {
                speed = now.velocity;
                references.push(now.reference);
                told.extend(now.rested_s.map(|lost_s| (k, lost_s)));
            }
        }
        (references, told)
    }

    #[test]
    fn after_a_gap_it_brakes_from_where_the_joint_is_whatever_setpoints_come() {
        for (position, velocity) in [(0.8, 0.3), (0.8, 1.5), (-0.4, -0.5), (0.29, 0.0)] {
            let (references, told) = left(position, velocity);
            // The joint lagged a step of 0.3 mrad behind its reference before the gap.
            assert!((references[0] - position - velocity * 1e-3).abs() <= 3e-4 + 1e-9, "{} rad", references[0]);
            let told_at = told.first().map_or(0, |(k, _)| *k as usize - 1000);
            assert!(matches!(told[..], [(_, lost_s)] if (lost_s - 0.7).abs() < 1e-9) && told_at < 500, "{told:?}");
            let braking = &references[..=told_at];
            let speeds: Vec<f64> = braking.windows(2).map(|two| (two[1] - two[0]) / 1e-3).collect();
            let hardest = speeds.windows(2).map(|two| ((two[1] - two[0]) / 1e-3).abs()).fold(0.0, f64::max);
            assert!(hardest <= 5.0 * (1.0 + 1e-6), "{hardest} rad/s²");
            assert!(speeds.last().is_some_and(|speed| speed.abs() < 1e-3), "{:?} rad/s at the end", speeds.last());
            assert!((braking[told_at] - position).abs() <= velocity * velocity / 5.0 + 0.1 * velocity.abs() + 3e-4 + 1e-9, "{} rad", braking[told_at]);
        }
    }
}
