// SPDX-License-Identifier: Apache-2.0
use crate::online::{State, towards};
use crate::pace;
use crate::profile::Limits;
use crate::span::Span;
use crate::takeover::Last;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// A position, velocity or ratio is not a finite number.
const NOT_FINITE: u32 = 1;
/// The speed or acceleration is not above 0.
const BAD_LIMIT: u32 = 2;

/// Relative tolerance for the comparison of a requested speed with the limit.
const ROUNDING: f64 = 1e-9;
/// Number of invocations until the reaction to `at_limit` slows the slave down.
const REACTION: f64 = 2.0;

/// Gear: set-point' = ratio × master', once the slave has reached that speed within its maximum acceleration.
///
/// The slave may be moving at the start. From the invocation that reports `in_gear`, each step of the slave is the ratio times the step
/// of the master, so the relation of their positions is kept. If the slave would have to change its speed by more than `acceleration`
/// allows, it falls out of gear, and engages again by the same rule (a gear couples speeds, not positions). During engagement, the
/// slave's acceleration changes at the rate `jerk`; in gear, its acceleration follows the master's. If time was lost because releases
/// were skipped, the slave keeps its speed for one cycle; if the time lost in a single gap exceeds `gap_max`, it comes to rest and `gap`
/// is reported. `too_fast` is reported if the slave moves at `speed` and would have to be faster; `at_limit` is reported if the distance
/// to the end of its range is just enough to stop, within `deceleration` and `jerk`. Faults: 1 a number is not finite; 2 a limit is not
/// above 0.
#[derive(FunctionBlock)]
pub struct GearGenerator {
    /// position of the master
    #[input(asynchronous, unit = "rad|m")]
    master: f64,
    /// current commanded position of the slave
    #[input(asynchronous, unit = "rad|m")]
    start: f64,
    /// current speed at which the slave's servo moves it
    #[input(asynchronous, default = 0.0, unit = "rad/s|m/s", range = "[-inf, inf)")]
    start_velocity: f64,
    /// speed of the slave's last set-points, whichever motion generated them
    #[input(asynchronous, default = 0.0, unit = "rad/s|m/s", range = "[-inf, inf)")]
    last_velocity: f64,
    /// acceleration of the last set-points
    #[input(asynchronous, default = 0.0, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
    last_acceleration: f64,
    /// time at which the last set-points were stored, ns of the system clock
    #[input(asynchronous, default = i64::MIN, range = "[-inf, inf)")]
    last_time: i64,
    /// braking by the slave's servo itself because set-points did not arrive in time: see `joint_servo`
    #[input(asynchronous, default = [0.0; 4], range = "[-inf, inf)")]
    braking: [f64; 4],
    /// step of the slave per step of the master; negative: opposite direction
    #[input(asynchronous, default = 1.0, range = "[-inf, inf)")]
    ratio: f64,
    /// maximum speed of the slave
    #[input(asynchronous, default = 0.5, unit = "rad/s|m/s", range = "[0, inf)")]
    speed: f64,
    /// maximum acceleration of the slave
    #[input(asynchronous, default = 5.0, unit = "rad/s^2|m/s^2", range = "[0, inf)")]
    acceleration: f64,
    /// deceleration at which the slave can be stopped before the end of its range
    #[input(asynchronous, default = [5.0; 1], unit = "rad/s^2|m/s^2", range = "[0, inf)")]
    deceleration: [f64; 1],
    /// jerk at which the slave can be stopped
    #[input(asynchronous, default = [50.0; 1], unit = "rad/s^3|m/s^3", range = "[0, inf)")]
    jerk: [f64; 1],
    /// minimum position of the slave
    #[input(asynchronous, default = [-1e6; 1], unit = "rad|m", range = "[-inf, inf)")]
    position_min: [f64; 1],
    /// maximum position of the slave
    #[input(asynchronous, default = [1e6; 1], unit = "rad|m", range = "[-inf, inf)")]
    position_max: [f64; 1],
    /// maximum time lost in a single gap; if it is exceeded, the slave comes to rest
    #[input(asynchronous, default = [0.5; 1], unit = "s", range = "(0, inf)")]
    gap_max: [f64; 1],
    /// commanded position of the slave
    #[output(unit = "rad|m")]
    setpoint: f64,
    /// commanded speed at the set-point
    #[output(unit = "rad/s|m/s")]
    velocity: f64,
    /// speed of the set-point at the end of the cycle
    #[output(unit = "rad/s|m/s")]
    setpoint_velocity: f64,
    /// acceleration of the set-point
    #[output(unit = "rad/s^2|m/s^2")]
    setpoint_acceleration: f64,
    /// time at which the set-point is stored, ns of the system clock
    #[output]
    setpoint_time: i64,
    /// longest time lost in a single gap so far
    #[output(unit = "s")]
    lost: f64,
    /// true if the slave follows the ratio
    #[output]
    engaged: bool,
    /// time from the start to the first set-point: the interval of this block
    #[param(default = 0.02, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// the slave follows the ratio
    #[condition]
    in_gear: Condition,
    /// the slave moves towards the end of its range, and the remaining distance is just enough to stop
    #[condition]
    at_limit: Condition,
    /// the slave moves at its maximum speed, but would have to move faster
    #[condition]
    too_fast: Condition,
    /// the slave is at rest because the time lost in a single gap exceeded `gap_max`; the value is the time lost, s
    #[condition]
    gap: ConditionOf<f64>,
    /// position of the master in the previous invocation
    #[state]
    before: f64,
    /// state of the motion of the slave
    #[state(opaque)]
    state: State,
    /// most recent steps of the slave
    #[state(opaque)]
    steps: Steps,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
}

/// Mean speed of the slave over the last cycle, its change, the number of cycles on which they are based, and the speed requested by the
/// master.
#[derive(Clone, Copy, Debug, Default)]
struct Steps {
    mean: f64,
    change: f64,
    count: u32,
    wanted: f64,
    /// True if the slave is coming to rest because time was lost.
    is_lost: bool,
}

impl Step for GearGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if ![self.master, self.start, self.start_velocity, self.ratio].iter().all(|x| x.is_finite()) {
            return Outcome::Fault(NOT_FINITE);
        }
        if ![self.speed, self.acceleration, self.deceleration[0], self.jerk[0]].iter().all(|limit| limit.is_finite() && *limit > 0.0) {
            return Outcome::Fault(BAD_LIMIT);
        }
        let first = !self.span.begun();
        let passed = self.span.pass(invocation);
        let mut span_s = passed.cycle_s();
        if first {
            let (start, servo_velocity, time_ns) = ([self.start], [self.start_velocity], [self.last_time]);
            let (velocity, acceleration) = ([self.last_velocity], [self.last_acceleration]);
            let last = Last { position: &start, servo_velocity: &servo_velocity, velocity: &velocity, acceleration: &acceleration, time_ns: &time_ns, braking: &[self.braking] };
            let Some(begun) = last.begin(invocation.now_ns, self.lead) else { return Outcome::Fault(NOT_FINITE) };
            span_s = begun.ahead_s;
            self.state = begun.motion.state(0);
            (self.setpoint, self.before) = (self.state.position, self.master);
            // At rest the last steps are known to be 0.
            self.steps.count = if self.state.is_at_rest() { 2 } else { 0 };
        }
        if span_s <= 0.0 {
            return Outcome::Done;
        }
        if pace::note_lost(passed, &self.gap_max, &mut self.lost) {
            self.steps.is_lost = true;
        }
        self.follow(span_s, first || passed.lost_ns > 0);
        self.setpoint_time = invocation.now_ns;
        Outcome::Done
    }
}

impl GearGenerator {
    /// Advances by one cycle. If the speed of the master is `unknown`, the slave keeps its own speed.
    fn follow(&mut self, span_s: f64, unknown: bool) {
        let wanted = if unknown { self.state.velocity } else { self.ratio * (self.master - self.before) / span_s };
        self.before = self.master;
        // Checked before the state of the gear changes.
        self.engaged = !unknown && !self.steps.is_lost && wanted.abs() <= self.speed * (1.0 + ROUNDING) && self.can_follow(wanted, span_s);
        if self.engaged {
            let change = (wanted - self.steps.mean) / span_s;
            // On the parabola through the last three set-points.
            self.state = State { position: self.setpoint + wanted * span_s, velocity: wanted + change * span_s / 2.0, acceleration: change };
        } else {
            let limits = Limits { speed: self.speed, acceleration: self.acceleration, jerk: self.jerk[0] };
            let target = if self.steps.is_lost { 0.0 } else { wanted.clamp(-self.speed, self.speed) };
            self.state = towards(self.state, target, limits, span_s);
        }
        let (least, most) = (self.position_min[0].min(self.setpoint), self.position_max[0].max(self.setpoint));
        self.state.position = self.state.position.clamp(least, most);
        let mean = if self.engaged { wanted } else { (self.state.position - self.setpoint) / span_s };
        self.steps = Steps { mean, change: (mean - self.steps.mean) / span_s, count: self.steps.count.saturating_add(1), wanted, ..self.steps };
        if self.steps.is_lost && self.state.is_at_rest() {
            // The motion may resume, if the gap does not end it.
            self.steps.is_lost = false;
            self.gap.report(self.lost);
        }
        (self.setpoint, self.velocity) = (self.state.position, mean);
        (self.setpoint_velocity, self.setpoint_acceleration) = (self.state.velocity, self.state.acceleration);
        if self.engaged {
            self.in_gear.report();
        }
        if wanted.abs() > self.speed * (1.0 + ROUNDING) && mean.abs() >= self.speed * (1.0 - ROUNDING) {
            self.too_fast.report();
        }
        if self.is_near_the_end(span_s) {
            self.at_limit.report();
        }
    }

    /// Returns true if the slave can move at `wanted` from this cycle on, within its acceleration and, if it is not in gear, within its
    /// jerk.
    fn can_follow(&self, wanted: f64, span_s: f64) -> bool {
        let change = (wanted - self.steps.mean) / span_s;
        if change.abs() > self.acceleration * (1.0 + ROUNDING) {
            return false;
        }
        // Not in gear: within the jerk from its own acceleration to this one, and from there to the master's.
        let masters = (wanted - self.steps.wanted) / span_s;
        let fits = |from: f64| (change - from).abs() <= self.jerk[0] * span_s * (1.0 + ROUNDING);
        self.engaged || self.steps.count >= 2 && fits(self.steps.change) && fits(masters)
    }

    /// Returns true if the distance from the slave to the end of its range is at most its stopping distance, including the distance moved
    /// until braking begins.
    fn is_near_the_end(&self, span_s: f64) -> bool {
        let ([deceleration], [jerk], speed) = (self.deceleration, self.jerk, self.velocity.abs());
        let left = if self.velocity > 0.0 { self.position_max[0] - self.setpoint } else { self.setpoint - self.position_min[0] };
        let way = if speed * jerk >= deceleration * deceleration {
            0.5 * speed * (speed / deceleration + deceleration / jerk)
        } else {
            speed * (speed / jerk).sqrt()
        };
        speed > 0.0 && left <= way + REACTION * speed * span_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gear(ratio: f64) -> GearGenerator {
        GearGenerator {
            master: 1.0, start: 0.25, start_velocity: 0.0, last_velocity: 0.0, last_acceleration: 0.0, last_time: i64::MIN, braking: [0.0; 4], gap_max: [0.5], setpoint_velocity: 0.0, setpoint_acceleration: 0.0, setpoint_time: 0, lost: 0.0, ratio, speed: 1.0, acceleration: 2.0, deceleration: [5.0], jerk: [50.0],
            position_min: [-1e6], position_max: [1e6], setpoint: 0.0, velocity: 0.0, engaged: false, lead: 0.02,
            in_gear: Condition::new(), at_limit: Condition::new(), too_fast: Condition::new(), before: 0.0, gap: ConditionOf::new(0.0), state: State::default(), steps: Steps::default(), span: Span::default(),
        }
    }

    #[test]
    fn the_slave_comes_up_to_speed_and_then_follows_every_step() {
        let mut gear = gear(-2.0);
        let (mut engaged_at, mut relation) = (None, 0.0);
        for k in 0..200i64 {
            gear.master = 1.0 + 0.3 * k as f64 * 0.02;
            let before = gear.velocity;
            assert_eq!(gear.step(&Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }), Outcome::Done);
            assert!((gear.velocity - before).abs() <= 0.04 + 1e-12);
            match engaged_at {
                None if gear.engaged => (engaged_at, relation) = (Some(k), gear.setpoint + 2.0 * gear.master),
                Some(_) => assert!((gear.setpoint + 2.0 * gear.master - relation).abs() < 1e-9, "at {k}"),
                None => {}
            }
        }
        assert!(matches!(engaged_at, Some(16..=19)), "0.6 rad/s at 2 rad/s² and 50 rad/s³ takes 0.34 s: {engaged_at:?}");
    }

    #[test]
    fn it_is_never_faster_than_its_maximum_speed() {
        let mut gear = gear(100.0);
        for k in 0..200i64 {
            gear.master = 1.0 + 0.3 * k as f64 * 0.02;
            assert_eq!(gear.step(&Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }), Outcome::Done);
            assert!(gear.velocity <= 1.0 + 1e-12 && !gear.engaged);
        }
        assert_eq!(GearGenerator { speed: 0.0, ..self::gear(1.0) }.step(&Invocation::default()), Outcome::Fault(BAD_LIMIT));
        assert_eq!(GearGenerator { master: f64::NAN, ..self::gear(1.0) }.step(&Invocation::default()), Outcome::Fault(NOT_FINITE));
    }
}
