// SPDX-License-Identifier: Apache-2.0
use crate::motion::Motion;
use crate::online::Profile;
use crate::pace;
use crate::profile::Limits;
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// A start or velocity is not a finite number.
const NOT_FINITE: u32 = 1;
/// Invocations on end with one set-point that count as rest: until then a servo that follows the set-points smoothly still moves.
const REST: u16 = 3;
/// An acceleration or jerk is not above 0, or an override is not within 0 and 1.
const BAD_LIMIT: u32 = 2;

/// Velocity generator: setpoint = q(t) with q' going to `velocity` within acceleration and jerk, and to rest before the end of the joint's range.
///
/// It begins from a start that may move. With `velocity` 0, which is the default, it stops the joints: `stopped` is reported when they are
/// at rest. A velocity may change at any time. Where `holding` is true or an override is 0 the joints come to rest and stay; `held` is
/// reported while they do. At the end of its range a joint comes to rest and `at_limit` is reported.
/// Faults: 1 a start or velocity is not finite; 2 an acceleration or jerk is not above 0, or an override not within 0 and 1.
#[derive(FunctionBlock)]
pub struct VelocityGenerator {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// where the joints are commanded to be now
    #[input(asynchronous, sized, unit = "rad|m")]
    start: [f64; 16],
    /// how fast they are commanded to move now
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s")]
    start_velocity: [f64; 16],
    /// how fast they are to move
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s")]
    velocity: [f64; 16],
    /// maximum acceleration of each joint
    #[input(asynchronous, default = [5.0; 16], sized, unit = "rad/s^2|m/s^2")]
    acceleration: [f64; 16],
    /// maximum jerk of each joint
    #[input(asynchronous, default = [50.0; 16], sized, unit = "rad/s^3|m/s^3")]
    jerk: [f64; 16],
    /// minimum position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized, unit = "rad|m")]
    position_min: [f64; 16],
    /// maximum position of each joint
    #[input(asynchronous, default = [1e6; 16], sized, unit = "rad|m")]
    position_max: [f64; 16],
    /// share of the velocity that is allowed now, 0 to 1; the least of the joints counts for all
    #[input(asynchronous, default = [1.0; 16], sized)]
    r#override: [f64; 16],
    /// the same for the whole cell; both are multiplied
    #[input(asynchronous, default = [1.0; 16], sized)]
    cell_override: [f64; 16],
    /// come to rest and stay
    #[input(asynchronous, default = false)]
    holding: bool,
    /// where the joints are to be
    #[output(sized, unit = "rad|m")]
    setpoint: [f64; 16],
    /// how fast they are to be there
    #[output(sized, unit = "rad/s|m/s")]
    setpoint_velocity: [f64; 16],
    /// time by which the first set-point is ahead of the start: the interval of this block
    #[param(default = 0.02, unit = "s")]
    lead: f64,
    /// the joints move the other way
    #[param(default = false)]
    reverse: bool,
    /// all joints move as fast as they are to
    #[condition]
    in_velocity: Condition,
    /// all joints are at rest and are to be
    #[condition]
    stopped: Condition,
    /// the joints are at rest because they are held
    #[condition]
    held: Condition,
    /// a joint is at rest at the end of its range, and is to go on
    #[condition]
    at_limit: Condition,
    /// where the joints are on their way
    #[state(opaque)]
    motion: Motion,
    /// velocities, accelerations, jerks that it is planned for
    #[state]
    planned: [f64; 48],
    /// whether it is planned to hold
    #[state]
    is_holding: bool,
    /// invocations on end for which each joint has been at rest
    #[state]
    rest: [u16; 16],
    /// running time of the invocation before, ns; -1: there was none
    #[state(initial = -1)]
    before_ns: i64,
}

impl Step for VelocityGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let first = self.before_ns < 0;
        if first {
            let Some(motion) = Motion::begin(&self.start[..n], &self.start_velocity[..n]) else { return Outcome::Fault(NOT_FINITE) };
            self.motion = motion;
        }
        let Some(rate) = pace::allowed(&self.r#override[..n], &self.cell_override[..n]) else { return Outcome::Fault(BAD_LIMIT) };
        let direction = if self.reverse { -1.0 } else { 1.0 };
        let mut wanted = [0.0; 48];
        for i in 0..n {
            if !self.velocity[i].is_finite() {
                return Outcome::Fault(NOT_FINITE);
            }
            if ![self.acceleration[i], self.jerk[i]].iter().all(|limit| limit.is_finite() && *limit > 0.0) {
                return Outcome::Fault(BAD_LIMIT);
            }
            (wanted[i], wanted[16 + i], wanted[32 + i]) = (direction * self.velocity[i] * rate, self.acceleration[i], self.jerk[i]);
        }
        let holding = self.holding || rate == 0.0;
        if first || wanted != self.planned || holding != self.is_holding {
            (self.planned, self.is_holding) = (wanted, holding);
            self.plan();
        }
        self.motion.advance(if first { self.lead } else { (invocation.time_ns - self.before_ns) as f64 * 1e-9 });
        self.before_ns = invocation.time_ns;
        self.store(n);
        Outcome::Done
    }
}

impl VelocityGenerator {
    /// A joint that is to move goes to the end of its range at that speed, so that it comes to rest there.
    fn plan(&mut self) {
        let (planned, holding, least, most) = (self.planned, self.is_holding, self.position_min, self.position_max);
        self.motion.each(|i, state| {
            let velocity = if holding { 0.0 } else { planned[i] };
            let limits = Limits { speed: velocity.abs(), acceleration: planned[16 + i], jerk: planned[32 + i] };
            let stop = Profile::stop(state, limits);
            let end = if velocity > 0.0 { most[i] } else { least[i] };
            // Where it cannot stop before the end of its range, or is beyond it, it stops as soon as it can.
            let has_room = velocity != 0.0 && (end - stop.end()) * velocity > 0.0;
            if has_room { Profile::to(state, end, limits) } else { stop }
        });
    }

    fn store(&mut self, n: usize) {
        let (mut in_velocity, mut at_limit) = (!self.is_holding, false);
        for i in 0..n {
            let state = self.motion.state(i);
            (self.setpoint[i], self.setpoint_velocity[i]) = (state.position, state.velocity);
            let velocity = self.planned[i];
            self.rest[i] = if state.velocity == 0.0 { self.rest[i].saturating_add(1) } else { 0 };
            let rests = self.rest[i] >= REST;
            in_velocity &= (state.velocity - velocity).abs() <= 1e-9 * velocity.abs().max(1.0) && state.acceleration.abs() <= 1e-9;
            let end = if velocity > 0.0 { self.position_max[i] - state.position } else { state.position - self.position_min[i] };
            at_limit |= rests && velocity != 0.0 && !self.is_holding && end <= 1e-9;
        }
        let all_rest = self.rest[..n].iter().all(|invocations| *invocations >= REST);
        if in_velocity {
            self.in_velocity.report();
        }
        if all_rest && self.planned[..n].iter().all(|velocity| *velocity == 0.0) {
            self.stopped.report();
        }
        if all_rest && self.is_holding {
            self.held.report();
        }
        if at_limit {
            self.at_limit.report();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generator(velocity: f64) -> VelocityGenerator {
        VelocityGenerator {
            n: 1, start: [0.0; 16], start_velocity: [0.0; 16], velocity: [velocity; 16], acceleration: [2.0; 16], jerk: [20.0; 16],
            position_min: [-3.0; 16], position_max: [3.0; 16], r#override: [1.0; 16], cell_override: [1.0; 16], holding: false, setpoint: [0.0; 16],
            setpoint_velocity: [0.0; 16], lead: 0.02, reverse: false, in_velocity: Condition::new(), stopped: Condition::new(), held: Condition::new(),
            at_limit: Condition::new(), motion: Motion::default(), planned: [0.0; 48], is_holding: false, rest: [0; 16], before_ns: -1,
        }
    }

    /// Invocations every 20 ms until `until`, at most 1000: how many; every step keeps to the acceleration.
    fn run(block: &mut VelocityGenerator, mut until: impl FnMut(i64, &mut VelocityGenerator) -> bool) -> i64 {
        let (mut at, mut rate) = (block.start[0], block.start_velocity[0]);
        let begin = (block.before_ns + 20_000_000) / 20_000_000;
        for k in begin..begin + 1000 {
            (block.in_velocity, block.stopped, block.held, block.at_limit) = (Condition::new(), Condition::new(), Condition::new(), Condition::new());
            assert_eq!(block.step(&Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }), Outcome::Done);
            let speed = (block.setpoint[0] - at) / 0.02;
            assert!((speed - rate).abs() <= 2.0 * 0.02 + 1e-9, "from {rate} to {speed} rad/s at {k}");
            (at, rate) = (block.setpoint[0], speed);
            if until(k, block) {
                return k;
            }
        }
        1000
    }

    #[test]
    fn it_comes_to_its_velocity_keeps_it_and_stops_at_the_end_of_the_range() {
        let mut block = generator(0.5);
        // 0.5/2 + 2/20 s.
        assert_eq!(run(&mut block, |_, b| b.in_velocity.is_reported()), 17);
        assert!((block.setpoint_velocity[0] - 0.5).abs() < 1e-12);
        let mut block = generator(0.5);
        run(&mut block, |_, b| b.at_limit.is_reported());
        assert_eq!((block.setpoint[0], block.setpoint_velocity[0]), (3.0, 0.0));
    }

    #[test]
    fn it_stops_from_a_moving_start() {
        let mut block = generator(0.0);
        block.start_velocity[0] = -0.8;
        let k = run(&mut block, |_, b| b.stopped.is_reported());
        assert!(k < 30 && block.setpoint_velocity[0] == 0.0 && block.setpoint[0] < -0.16);
    }

    #[test]
    fn velocity_override_and_holding_change_it_smoothly() {
        let mut block = generator(0.5);
        let mut held = 0;
        run(&mut block, |k, b| {
            held += i32::from(b.held.is_reported());
            b.velocity[0] = if k > 150 { -0.5 } else { 0.5 };
            b.r#override[0] = if k > 50 { 0.5 } else { 1.0 };
            b.holding = (80..120).contains(&k);
            k > 200
        });
        assert!((block.setpoint_velocity[0] + 0.25).abs() < 1e-9 && held > 10, "{} rad/s, held {held}", block.setpoint_velocity[0]);
    }

    #[test]
    fn what_cannot_be_done_is_a_fault_with_its_code() {
        let mut block = generator(f64::NAN);
        assert_eq!(block.step(&Invocation::default()), Outcome::Fault(NOT_FINITE));
        let mut block = generator(1.0);
        block.jerk[0] = 0.0;
        assert_eq!(block.step(&Invocation::default()), Outcome::Fault(BAD_LIMIT));
    }
}
