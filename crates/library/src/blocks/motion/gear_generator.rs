// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// A position, velocity or ratio is not a finite number.
const NOT_FINITE: u32 = 1;
/// The speed or acceleration is not above 0.
const BAD_LIMIT: u32 = 2;

/// Wanted speeds of the limit itself are no faster than it.
const ROUNDING: f64 = 1e-9;
/// Invocations until what follows `at_limit` slows it down.
const REACTION: f64 = 2.0;

/// Gear: setpoint' = ratio × master', once the speed of the slave has come to it at its maximum acceleration.
///
/// It begins from a start that may move. From the invocation that reports `in_gear` on, each step of the slave is the ratio times the step
/// of the master, so the relation of their positions stays; where the slave would have to change its speed by more than `acceleration`
/// allows, it falls back, and comes into gear again by the same rule (a gear couples speeds, not positions). `too_fast` is reported where
/// it moves at `speed` and would have to be faster; `at_limit` where it has just room to stop before the end of its range, within
/// `deceleration` and `jerk`. Faults: 1 a number is not finite; 2 a limit is not above 0.
#[derive(FunctionBlock)]
pub struct GearGenerator {
    /// position of the master
    #[input(asynchronous, unit = "rad|m")]
    master: f64,
    /// where the slave is commanded to be now
    #[input(asynchronous, unit = "rad|m")]
    start: f64,
    /// how fast it is commanded to move now
    #[input(asynchronous, default = 0.0, unit = "rad/s|m/s")]
    start_velocity: f64,
    /// steps of the slave for each step of the master; negative: the other way
    #[input(asynchronous, default = 1.0)]
    ratio: f64,
    /// maximum speed of the slave
    #[input(asynchronous, default = 0.5, unit = "rad/s|m/s")]
    speed: f64,
    /// maximum acceleration of the slave
    #[input(asynchronous, default = 5.0, unit = "rad/s^2|m/s^2")]
    acceleration: f64,
    /// acceleration at which it can be stopped before the end of its range
    #[input(asynchronous, default = [5.0; 1], unit = "rad/s^2|m/s^2")]
    deceleration: [f64; 1],
    /// jerk at which it can be stopped
    #[input(asynchronous, default = [50.0; 1], unit = "rad/s^3|m/s^3")]
    jerk: [f64; 1],
    /// minimum position of the slave
    #[input(asynchronous, default = [-1e6; 1], unit = "rad|m")]
    position_min: [f64; 1],
    /// maximum position of the slave
    #[input(asynchronous, default = [1e6; 1], unit = "rad|m")]
    position_max: [f64; 1],
    /// where the slave is to be
    #[output(unit = "rad|m")]
    setpoint: f64,
    /// how fast it is to be there
    #[output(unit = "rad/s|m/s")]
    velocity: f64,
    /// whether the slave moves as the ratio says
    #[output]
    engaged: bool,
    /// time by which the first set-point is ahead of the start: the interval of this block
    #[param(default = 0.02, unit = "s")]
    lead: f64,
    /// the slave moves as the ratio says
    #[condition]
    in_gear: Condition,
    /// the slave moves towards the end of its range, and has just room to stop
    #[condition]
    at_limit: Condition,
    /// the slave moves as fast as it may, and would have to be faster
    #[condition]
    too_fast: Condition,
    /// position of the master in the invocation before
    #[state]
    before: f64,
    /// running time of the invocation before, ns; -1: there was none
    #[state(initial = -1)]
    before_ns: i64,
}

impl Step for GearGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if ![self.master, self.start, self.start_velocity, self.ratio].iter().all(|x| x.is_finite()) {
            return Outcome::Fault(NOT_FINITE);
        }
        if ![self.speed, self.acceleration, self.deceleration[0], self.jerk[0]].iter().all(|limit| limit.is_finite() && *limit > 0.0) {
            return Outcome::Fault(BAD_LIMIT);
        }
        let first = self.before_ns < 0;
        let span_s = if first { self.lead } else { (invocation.time_ns - self.before_ns) as f64 * 1e-9 };
        if first {
            (self.setpoint, self.velocity, self.before) = (self.start, self.start_velocity, self.master);
        }
        let wanted = self.ratio * (self.master - self.before) / span_s;
        let most = self.acceleration * span_s;
        // In the first invocation the master's speed is not known: the slave keeps its own.
        let next = if first { self.velocity } else { wanted.clamp(-self.speed, self.speed).clamp(self.velocity - most, self.velocity + most) };
        self.engaged = !first && next == wanted;
        let (least, most) = (self.position_min[0].min(self.setpoint), self.position_max[0].max(self.setpoint));
        self.setpoint = (self.setpoint + next * span_s).clamp(least, most);
        self.velocity = next;
        (self.before, self.before_ns) = (self.master, invocation.time_ns);
        if self.engaged {
            self.in_gear.report();
        }
        if wanted.abs() > self.speed * (1.0 + ROUNDING) && next.abs() >= self.speed {
            self.too_fast.report();
        }
        if self.is_near_the_end(span_s) {
            self.at_limit.report();
        }
        Outcome::Done
    }
}

impl GearGenerator {
    /// Whether the way to the end of its range is not longer than the way to rest, with what it moves until somebody slows it down.
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
            master: 1.0, start: 0.25, start_velocity: 0.0, ratio, speed: 1.0, acceleration: 2.0, deceleration: [5.0], jerk: [50.0],
            position_min: [-1e6], position_max: [1e6], setpoint: 0.0, velocity: 0.0, engaged: false, lead: 0.02,
            in_gear: Condition::new(), at_limit: Condition::new(), too_fast: Condition::new(), before: 0.0, before_ns: -1,
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
        assert!(matches!(engaged_at, Some(15 | 16)), "0.6 rad/s at 2 rad/s² takes 0.3 s");
    }

    #[test]
    fn it_is_never_faster_than_its_maximum_speed() {
        let mut gear = gear(100.0);
        for k in 0..200i64 {
            gear.master = 1.0 + 0.3 * k as f64 * 0.02;
            assert_eq!(gear.step(&Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }), Outcome::Done);
            assert!(gear.velocity <= 1.0 && !gear.engaged);
        }
        assert_eq!(GearGenerator { speed: 0.0, ..self::gear(1.0) }.step(&Invocation::default()), Outcome::Fault(BAD_LIMIT));
        assert_eq!(GearGenerator { master: f64::NAN, ..self::gear(1.0) }.step(&Invocation::default()), Outcome::Fault(NOT_FINITE));
    }
}
