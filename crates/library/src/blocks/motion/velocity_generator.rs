// SPDX-License-Identifier: Apache-2.0
use crate::motion::Motion;
use crate::online::Profile;
use crate::pace;
use crate::profile::Limits;
use crate::span::Span;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// A start or velocity is not a finite number.
const NOT_FINITE: u32 = 1;
/// Number of consecutive invocations with an unchanged set-point that count as rest. Before that, a servo that smooths the set-points is
/// still moving.
const REST: u16 = 3;
/// An acceleration or jerk is not above 0, or an override is not between 0 and 1.
const BAD_LIMIT: u32 = 2;

/// Velocity generator: setpoint = q(t) whose q' approaches `velocity` within acceleration and jerk, and comes to rest before the end of
/// the joint's range.
///
/// The joints may be moving at the start. With `velocity` 0, the default, it stops them: `stopped` is reported when they are at rest. A
/// velocity may change at any time. If `holding` is true or an override is 0, the joints come to rest and stay there; `held` is reported
/// as long as they do. Time lost because releases were skipped is not made up for: each invocation advances by at most one cycle; if the
/// time lost in a single gap exceeds `gap_max`, the joints come to rest and `gap` is reported. At the end of its range, a joint comes to
/// rest and `at_limit` is reported. Faults: 1 a start or velocity is not finite; 2 an acceleration or jerk is not above 0, or an override
/// is not between 0 and 1.
#[derive(FunctionBlock)]
pub struct VelocityGenerator {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// current commanded positions of the joints
    #[input(asynchronous, sized, unit = "rad|m")]
    start: [f64; 16],
    /// current speed at which the servos move the joints
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    start_velocity: [f64; 16],
    /// speed of the last set-points, whichever motion generated them
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    last_velocity: [f64; 16],
    /// acceleration of the last set-points
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
    last_acceleration: [f64; 16],
    /// time at which the last set-points were stored, ns of the system clock
    #[input(asynchronous, default = [i64::MIN; 16], sized, range = "[-inf, inf)")]
    last_time: [i64; 16],
    /// braking by the servos themselves because set-points did not arrive in time: see `joint_servo`
    #[input(asynchronous, default = [[0.0; 4]; 16], sized, range = "[-inf, inf)")]
    braking: [[f64; 4]; 16],
    /// requested velocity of each joint
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    velocity: [f64; 16],
    /// maximum acceleration of each joint
    #[input(asynchronous, default = [5.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[0, inf)")]
    acceleration: [f64; 16],
    /// maximum jerk of each joint
    #[input(asynchronous, default = [50.0; 16], sized, unit = "rad/s^3|m/s^3", range = "[0, inf)")]
    jerk: [f64; 16],
    /// minimum position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized, unit = "rad|m", range = "[-inf, inf)")]
    position_min: [f64; 16],
    /// maximum position of each joint
    #[input(asynchronous, default = [1e6; 16], sized, unit = "rad|m", range = "[-inf, inf)")]
    position_max: [f64; 16],
    /// permitted fraction of the velocity, 0 to 1; the minimum over the joints applies to all
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    r#override: [f64; 16],
    /// override of the whole cell; the two are multiplied
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    cell_override: [f64; 16],
    /// maximum time lost in a single gap; if it is exceeded, the joints come to rest
    #[input(asynchronous, default = [0.5; 16], sized, unit = "s", range = "(0, inf)")]
    gap_max: [f64; 16],
    /// true: bring the motion to rest and keep it there
    #[input(asynchronous, default = false)]
    holding: bool,
    /// commanded positions of the joints
    #[output(sized, unit = "rad|m")]
    setpoint: [f64; 16],
    /// commanded speed at the set-point
    #[output(sized, unit = "rad/s|m/s")]
    setpoint_velocity: [f64; 16],
    /// acceleration of the set-point
    #[output(sized, unit = "rad/s^2|m/s^2")]
    setpoint_acceleration: [f64; 16],
    /// time at which the set-points are stored, ns of the system clock
    #[output(sized)]
    setpoint_time: [i64; 16],
    /// longest time lost in a single gap so far
    #[output(unit = "s")]
    lost: f64,
    /// time from the start to the first set-point: the interval of this block
    #[param(default = 0.02, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// true: reverse the direction of all joints
    #[param(default = false)]
    reverse: bool,
    /// all joints move at their requested velocity
    #[condition]
    in_velocity: Condition,
    /// all joints are at rest as requested
    #[condition]
    stopped: Condition,
    /// the joints are at rest because they are held
    #[condition]
    held: Condition,
    /// a joint is at rest at the end of its range although motion is requested
    #[condition]
    at_limit: Condition,
    /// the joints are at rest because the time lost in a single gap exceeded `gap_max`; the value is the time lost, s
    #[condition]
    gap: ConditionOf<f64>,
    /// state of the motion of the joints
    #[state(opaque)]
    way: Way,
}

/// Moving joints, and the request for which their motion was planned.
#[derive(Clone, Copy, Debug, Default)]
struct Way {
    motion: Motion,
    wanted: JointVelocities,
    is_holding: bool,
    /// Number of consecutive invocations for which each joint has been at rest.
    rest: [u16; 16],
    span: Span,
    /// True if the joints are coming to rest because time was lost.
    is_lost: bool,
}

/// Velocities and limits of each joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct JointVelocities {
    velocity: [f64; 16],
    acceleration: [f64; 16],
    jerk: [f64; 16],
}

impl Step for VelocityGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let first = !self.way.span.begun();
        let mut ahead_s = 0.0;
        if first {
            let last = crate::takeover::last_setpoints!(self, n);
            let Some(begun) = last.begin(invocation.now_ns, self.lead) else { return Outcome::Fault(NOT_FINITE) };
            (self.way.motion, ahead_s) = (begun.motion, begun.ahead_s);
        }
        let Some(rate) = pace::allowed(&self.r#override[..n], &self.cell_override[..n]) else { return Outcome::Fault(BAD_LIMIT) };
        let direction = if self.reverse { -1.0 } else { 1.0 };
        let mut wanted = JointVelocities::default();
        for i in 0..n {
            if !self.velocity[i].is_finite() {
                return Outcome::Fault(NOT_FINITE);
            }
            if ![self.acceleration[i], self.jerk[i]].iter().all(|limit| limit.is_finite() && *limit > 0.0) {
                return Outcome::Fault(BAD_LIMIT);
            }
            (wanted.velocity[i], wanted.acceleration[i], wanted.jerk[i]) = (direction * self.velocity[i] * rate, self.acceleration[i], self.jerk[i]);
        }
        let passed = self.way.span.pass(invocation);
        if pace::note_lost(passed, &self.gap_max[..n], &mut self.lost) {
            self.way.is_lost = true;
        }
        let holding = self.holding || rate == 0.0 || self.way.is_lost;
        if first || wanted != self.way.wanted || holding != self.way.is_holding {
            (self.way.wanted, self.way.is_holding) = (wanted, holding);
            self.plan();
        }
        self.way.motion.advance(if first { ahead_s } else { passed.cycle_s() });
        self.setpoint_time = [invocation.now_ns; 16];
        self.store(n);
        Outcome::Done
    }
}

impl VelocityGenerator {
    /// Plans a motion of each moving joint to the end of its range at the requested speed, so that it comes to rest there.
    fn plan(&mut self) {
        let (JointVelocities { velocity, acceleration, jerk }, holding) = (self.way.wanted, self.way.is_holding);
        let (least, most) = (self.position_min, self.position_max);
        self.way.motion.each(|i, state| {
            let velocity = if holding { 0.0 } else { velocity[i] };
            let limits = Limits { speed: velocity.abs(), acceleration: acceleration[i], jerk: jerk[i] };
            let stop = Profile::stop(state, limits);
            let end = if velocity > 0.0 { most[i] } else { least[i] };
            // If the joint cannot stop before the end of its range, or is beyond it, it stops as soon as it can.
            let has_room = velocity != 0.0 && (end - stop.end()) * velocity > 0.0;
            if has_room { Profile::to(state, end, limits) } else { stop }
        });
    }

    fn store(&mut self, n: usize) {
        let (mut in_velocity, mut at_limit) = (!self.way.is_holding, false);
        for i in 0..n {
            let state = self.way.motion.state(i);
            (self.setpoint[i], self.setpoint_velocity[i], self.setpoint_acceleration[i]) = (state.position, state.velocity, state.acceleration);
            let velocity = self.way.wanted.velocity[i];
            self.way.rest[i] = if state.velocity == 0.0 { self.way.rest[i].saturating_add(1) } else { 0 };
            let rests = self.way.rest[i] >= REST;
            in_velocity &= (state.velocity - velocity).abs() <= 1e-9 * velocity.abs().max(1.0) && state.acceleration.abs() <= 1e-9;
            let end = if velocity > 0.0 { self.position_max[i] - state.position } else { state.position - self.position_min[i] };
            at_limit |= rests && velocity != 0.0 && !self.way.is_holding && end <= 1e-9;
        }
        let all_rest = self.way.rest[..n].iter().all(|invocations| *invocations >= REST);
        if self.way.is_lost && all_rest {
            // The joints may resume, if the gap does not end the motion.
            self.way.is_lost = false;
            self.gap.report(self.lost);
        }
        if in_velocity {
            self.in_velocity.report();
        }
        if all_rest && self.way.wanted.velocity[..n].iter().all(|velocity| *velocity == 0.0) {
            self.stopped.report();
        }
        if all_rest && self.way.is_holding {
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
            n: 1, start: [0.0; 16], start_velocity: [0.0; 16], last_velocity: [0.0; 16], last_acceleration: [0.0; 16], last_time: [i64::MIN; 16], braking: [[0.0; 4]; 16],
            gap_max: [0.5; 16], setpoint_acceleration: [0.0; 16], setpoint_time: [0; 16], lost: 0.0, gap: ConditionOf::new(0.0), velocity: [velocity; 16], acceleration: [2.0; 16], jerk: [20.0; 16],
            position_min: [-3.0; 16], position_max: [3.0; 16], r#override: [1.0; 16], cell_override: [1.0; 16], holding: false, setpoint: [0.0; 16],
            setpoint_velocity: [0.0; 16], lead: 0.02, reverse: false, in_velocity: Condition::new(), stopped: Condition::new(), held: Condition::new(),
            at_limit: Condition::new(), way: Way::default(),
        }
    }

    /// Invokes the block every 20 ms until `until` returns true, at most 1000 times, and returns the number of invocations. Checks that
    /// every step stays within the acceleration limit.
    fn run(block: &mut VelocityGenerator, mut until: impl FnMut(i64, &mut VelocityGenerator) -> bool) -> i64 {
        let (mut at, mut rate) = (block.start[0], block.start_velocity[0]);
        let begin = if block.way.span.begun() { block.setpoint_time[0] / 20_000_000 + 1 } else { 0 };
        for k in begin..begin + 1000 {
            (block.in_velocity, block.stopped, block.held, block.at_limit) = (Condition::new(), Condition::new(), Condition::new(), Condition::new());
            assert_eq!(block.step(&Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: k * 20_000_000 }), Outcome::Done);
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
