// SPDX-License-Identifier: Apache-2.0
use crate::pace;
use crate::path::Path;
use crate::span::Span;
use crate::takeover::{Brake, Last, Tail};
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// There is no planned path: the planner has not run, or found none.
const NO_PLAN: u32 = 1;
/// The path is planned for another number of joints.
const OTHER_SIZE: u32 = 2;
/// An override is not within 0 and 1.
const BAD_OVERRIDE: u32 = 3;
/// Points within a period at which a change of the pace is checked: a short line or blend may lie between two set-points.
const PLACES: u16 = 6;

/// Path generator: setpoint = q(τ) of a planned path, τ being running time at the pace of the override.
///
/// Joints that move when it begins are braked first, each by itself, and the planner plans from where they rest. `override` scales the speed (0 holds), `holding` ramps down to rest on the path and reports `held`; both change the pace no
/// faster than the acceleration limit of each joint allows. The output `complete` and the condition `finished` come with the last
/// set-point, exactly the last way-point. Time that is lost, because releases were skipped, is not made up for; where more than `gap_max`
/// was lost at once, it comes to rest on the path and `gap` is reported.
/// Faults: 1 there is no path; 2 it is planned for another number of joints; 3 an override is not within 0 and 1.
#[derive(FunctionBlock)]
pub struct PathGenerator {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// the planned path
    #[input(asynchronous)]
    path: Path,
    /// where the joints are commanded to be now, rad or m
    #[input(asynchronous, default = [0.0; 16], sized, range = "[-inf, inf)")]
    start: [f64; 16],
    /// speed at which their servos move them now
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    start_velocity: [f64; 16],
    /// speed of the last set-points, of whatever motion stored them
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    last_velocity: [f64; 16],
    /// acceleration of the last set-points
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
    last_acceleration: [f64; 16],
    /// when they were stored, ns of the system's clock
    #[input(asynchronous, default = [i64::MIN; 16], sized, range = "[-inf, inf)")]
    last_time: [i64; 16],
    /// lead of their servos by themselves, because no set-points came in their time: see `joint_servo`
    #[input(asynchronous, default = [[0.0; 4]; 16], sized, range = "[-inf, inf)")]
    braking: [[f64; 4]; 16],
    /// share of the speed that is allowed now, 0 to 1; the smallest of the joints counts for all
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    r#override: [f64; 16],
    /// the same for the whole cell; both are multiplied
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    cell_override: [f64; 16],
    /// true: it comes to rest and waits
    #[input(asynchronous, default = false)]
    holding: bool,
    /// time that may be lost at once; beyond it the motion comes to rest
    #[input(asynchronous, default = [0.5; 16], sized, unit = "s", range = "(0, inf)")]
    gap_max: [f64; 16],
    /// maximum acceleration of each joint
    #[input(asynchronous, default = [5.0; 16], sized, range = "(0, inf)")]
    acceleration_max: [f64; 16],
    /// maximum jerk of joints that move and are braked first
    #[input(asynchronous, default = [50.0; 16], sized, range = "(0, inf)")]
    jerk_max: [f64; 16],
    /// where the joints are to be, rad or m
    #[output(sized)]
    setpoint: [f64; 16],
    /// speed at which they are to be there, rad/s or m/s
    #[output(sized)]
    velocity: [f64; 16],
    /// acceleration of the set-points, rad/s^2 or m/s^2
    #[output(sized)]
    setpoint_acceleration: [f64; 16],
    /// when they are stored, ns of the system's clock
    #[output(sized)]
    setpoint_time: [i64; 16],
    /// the longest time that was lost at once
    #[output(unit = "s")]
    lost: f64,
    /// part of the path's time that is done, 0 to 1
    #[output]
    progress: f64,
    /// true if the last set-point is stored
    #[output]
    complete: bool,
    /// time between two set-points
    #[param(default = 0.02, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// the last set-point is stored
    #[condition]
    finished: Condition,
    /// it rests, as `holding` asks
    #[condition]
    held: Condition,
    /// it rests because more time than `gap_max` was lost at once; the value is how much, s
    #[condition]
    gap: ConditionOf<f64>,
    /// path that is under way
    #[state]
    plan: f64,
    /// time of the path, s
    #[state]
    time_s: f64,
    /// rate at which path time passes
    #[state]
    pace: f64,
    /// the invocation before
    #[state(opaque)]
    span: Span,
    /// true if it comes to rest because time was lost
    #[state]
    is_lost: bool,
    /// last set-points
    #[state(opaque)]
    tail: Tail,
    /// joints that are brought to rest first
    #[state(opaque)]
    brake: Brake,
}

/// Velocities and accelerations of all joints at one time of the path.
struct Motion {
    velocity: [f64; 16],
    acceleration: [f64; 16],
}

impl Step for PathGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let last = Last {
            position: &self.start[..n],
            servo_velocity: &self.start_velocity[..n],
            velocity: &self.last_velocity[..n],
            acceleration: &self.last_acceleration[..n],
            time_ns: &self.last_time[..n],
            braking: &self.braking[..n],
        };
        let (acceleration, jerk, has_plan) = (&self.acceleration_max[..n], &self.jerk_max[..n], self.path.plan >= 1.0);
        if let Some(now) = self.brake.step(&last, acceleration, jerk, self.lead, has_plan, invocation) {
            (self.setpoint, self.velocity, self.setpoint_acceleration) = (now.setpoint, now.velocity, now.acceleration);
            (self.setpoint_time, self.complete) = ([invocation.now_ns; 16], false);
            if now.is_at_rest && self.holding {
                self.held.report();
            }
            return Outcome::Done;
        }
        if self.path.plan < 1.0 {
            return Outcome::Fault(NO_PLAN);
        }
        if self.path.joints != n as i32 {
            return Outcome::Fault(OTHER_SIZE);
        }
        let Some(allowed) = pace::allowed(&self.r#override[..n], &self.cell_override[..n]) else { return Outcome::Fault(BAD_OVERRIDE) };
        if self.path.plan != self.plan {
            (self.plan, self.time_s, self.span, self.tail, self.is_lost) = (self.path.plan, 0.0, Span::default(), Tail::default(), false);
            // At the beginning the planned speed is 0: any pace will do.
            self.pace = if self.holding { 0.0 } else { allowed };
        }
        let passed = self.span.pass(invocation);
        if pace::note_lost(passed, &self.gap_max[..n], &mut self.lost) {
            self.is_lost = true;
        }
        let wanted = if self.holding || self.is_lost { 0.0 } else { allowed };
        let span_s = passed.cycle_s();
        let pace = self.pace;
        let after = pace::next(pace, wanted, span_s, |_, slope| {
            (0..=PLACES).all(|k| {
                let t = span_s * f64::from(k) / f64::from(PLACES);
                let (at, motion) = (pace + slope * t, self.motion(self.time_s + t * (pace + slope * t / 2.0)));
                (0..n).all(|i| self.fits(&motion, i, at, slope))
            })
        });
        self.time_s += span_s * (pace + after) / 2.0;
        self.pace = after;
        self.store(n);
        let rests = self.complete || self.pace == 0.0;
        self.tail.push(&self.setpoint[..n], span_s, rests, &mut self.velocity[..n], &mut self.setpoint_acceleration[..n]);
        self.setpoint_time = [invocation.now_ns; 16];
        Outcome::Done
    }
}

impl PathGenerator {
    fn motion(&self, time_s: f64) -> Motion {
        let n = self.n as usize;
        let mut motion = Motion { velocity: [0.0; 16], acceleration: [0.0; 16] };
        self.path.evaluate(time_s, &mut [0.0; 16][..n], &mut motion.velocity[..n], &mut motion.acceleration[..n]);
        motion
    }

    fn fits(&self, motion: &Motion, joint: usize, pace: f64, slope: f64) -> bool {
        let acceleration = pace::acceleration(motion.velocity[joint], motion.acceleration[joint], pace, slope);
        pace::within(acceleration, self.acceleration_max[joint])
    }

    fn store(&mut self, n: usize) {
        self.path.evaluate(self.time_s, &mut self.setpoint[..n], &mut [0.0; 16][..n], &mut [0.0; 16][..n]);
        self.complete = self.time_s >= self.path.duration;
        if self.is_lost && (self.pace == 0.0 || self.complete) {
            // It may go on, where that does not end the motion.
            self.is_lost = false;
            self.gap.report(self.lost);
        }
        self.progress = if self.complete { 1.0 } else { self.time_s / self.path.duration };
        if self.complete {
            self.finished.report();
        }
        if self.holding && (self.pace == 0.0 || self.complete) {
            self.held.report();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::plan;
    use crate::path::samples::{Case, case, numbers};

    fn generator(case: &Case) -> PathGenerator {
        PathGenerator {
            n: case.n as u32, path: plan(1.0, &case.start, &case.points, &case.passing, &case.limits), r#override: [1.0; 16], cell_override: [1.0; 16], holding: false,
            acceleration_max: std::array::from_fn(|i| case.limits.get(i).map_or(1.0, |l| l.acceleration)), setpoint: [0.0; 16], velocity: [0.0; 16],
            progress: 0.0, complete: false, finished: Condition::new(), held: Condition::new(), plan: 0.0, time_s: 0.0, pace: 0.0, span: Span::default(), is_lost: false, tail: Tail::default(), gap: ConditionOf::new(0.0), start: [0.0; 16], start_velocity: [0.0; 16], last_velocity: [0.0; 16], last_acceleration: [0.0; 16], last_time: [i64::MIN; 16], braking: [[0.0; 4]; 16],
            jerk_max: [50.0; 16], lead: 0.02, brake: Brake::default(), gap_max: [0.5; 16],
            setpoint_acceleration: [0.0; 16], setpoint_time: [0; 16], lost: 0.0,
        }
    }

    fn at(k: i64) -> Invocation {
        Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }
    }

    /// Steps it to its end, changing override and hold as `change` says; checks every step of every joint against the limits.
    fn run(seed: u64, case: &Case, mut change: impl FnMut(i64, &mut PathGenerator)) -> PathGenerator {
        const SPAN: f64 = 0.02;
        let mut block = generator(case);
        let (mut before, mut slower): ([f64; 16], [f64; 16]) = ([0.0; 16], [0.0; 16]);
        for k in 0..40_000 {
            change(k, &mut block);
            (block.finished, block.held) = (Condition::new(), Condition::new());
            assert_eq!(block.step(&at(k)), Outcome::Done);
            for i in 0..case.n {
                let limit = case.limits[i];
                let speed = if k == 0 { 0.0 } else { (block.setpoint[i] - before[i]) / SPAN };
                let acceleration = (speed - slower[i]) / SPAN;
                assert!(speed.abs() <= limit.speed * (1.0 + 1e-6), "seed {seed}: speed {speed} of joint {i} at {k}");
                assert!(acceleration.abs() <= limit.acceleration * 1.02 + 1e-6, "seed {seed}: acceleration {acceleration} of joint {i} at {k}, limit {}", limit.acceleration);
                (before[i], slower[i]) = (block.setpoint[i], speed);
            }
            if block.complete {
                assert!(block.finished.is_reported());
                return block;
            }
        }
        panic!("seed {seed}: it does not end");
    }

    #[test]
    fn limits_hold_under_any_override_and_hold_and_it_arrives_exactly() {
        for seed in 1..150 {
            let case = case(seed);
            let mut number = numbers(seed + 1000);
            let block = run(seed, &case, |k, block| {
                if k % 7 == 0 {
                    block.r#override = [number(-0.3, 1.5).clamp(0.0, 1.0); 16];
                    block.holding = number(0.0, 1.0) < 0.3;
                }
                if k > 3000 {
                    (block.r#override, block.holding) = ([1.0; 16], false);
                }
            });
            assert_eq!(block.setpoint[..case.n], case.points.last().expect("a point")[..case.n]);
        }
    }

    #[test]
    fn it_holds_where_it_is_and_goes_on() {
        let case = case(7);
        let (mut held_at, mut place) = (None, [0.0; 16]);
        run(7, &case, |k, block| {
            block.holding = (40..200).contains(&k);
            if block.held.is_reported() {
                held_at = held_at.or(Some(k));
                assert_eq!(block.velocity, [0.0; 16]);
                if k < 200 && held_at != Some(k) {
                    assert_eq!(block.setpoint, place, "it stands still");
                }
            }
            place = block.setpoint;
        });
        assert!(held_at.is_some_and(|k| k < 150), "{held_at:?}");
    }

    #[test]
    fn without_a_path_nothing_is_stored() {
        let case = case(1);
        let mut block = generator(&case);
        block.path.plan = 0.0;
        assert_eq!(block.step(&at(0)), Outcome::Fault(NO_PLAN));
        let mut block = PathGenerator { n: 9, ..generator(&case) };
        assert_eq!(block.step(&at(0)), Outcome::Fault(OTHER_SIZE));
    }
}
