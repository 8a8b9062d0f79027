// SPDX-License-Identifier: Apache-2.0
use crate::motion::Motion;
use crate::pace;
use crate::profile::Limits;
use crate::span::Span;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// A start or goal is not a finite number.
const NOT_FINITE: u32 = 1;
/// A speed, acceleration or jerk is not above 0, or an override is not between 0 and 1.
const BAD_LIMIT: u32 = 2;
/// A goal is outside its joint's range.
const OUT_OF_RANGE: u32 = 3;

/// Motion generator: setpoint = q(t), from a start at rest or in motion to rest at q = goal, within the speed, acceleration and jerk of
/// each joint.
///
/// It plans at the start, and again from the current state whenever goal, speed, override or holding change, so all of them may change at
/// any time without a jump. From rest, the joints move along a straight line in joint space; from a moving start, each joint moves on its
/// own, and they arrive together if they can. Time is running time, which stops while the verb is suspended. If `holding` is true or an
/// override is 0, the joints come to rest and stay there; `held` is reported as long as they do. Time lost because releases were skipped
/// is not made up for: each invocation advances by at most one cycle. If the time lost in a single gap exceeds `gap_max`, the joints come
/// to rest from their current state, and `gap` is reported when they have. `complete` and `finished` are reported in the invocation that
/// stores the goal, never before. If motion from rest to rest at a fixed speed is sufficient, `trajectory_planner` plans it in advance.
/// Faults: 1 a start or goal is not finite; 2 a limit is not above 0, or an override is not between 0 and 1; 3 a goal is outside its
/// range.
#[derive(FunctionBlock)]
pub struct MotionGenerator {
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
    /// goal positions
    #[input(asynchronous, sized, unit = "rad|m")]
    goal: [f64; 16],
    /// maximum speed of each joint
    #[input(asynchronous, default = [0.5; 16], sized, unit = "rad/s|m/s", range = "[0, inf)")]
    speed: [f64; 16],
    /// maximum speed of any joint; if not set, only the joints' own limits apply
    #[input(asynchronous, default = 1e6, unit = "rad/s|m/s", range = "(0, 100]")]
    fastest: f64,
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
    /// permitted fraction of the speed, 0 to 1; the minimum over the joints applies to all
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
    velocity: [f64; 16],
    /// acceleration of the set-point
    #[output(sized, unit = "rad/s^2|m/s^2")]
    setpoint_acceleration: [f64; 16],
    /// time at which the set-points are stored, ns of the system clock
    #[output(sized)]
    setpoint_time: [i64; 16],
    /// longest time lost in a single gap so far
    #[output(unit = "s")]
    lost: f64,
    /// absolute target: the goal, or the position at the start of the motion plus the goal
    #[output(sized, unit = "rad|m")]
    target: [f64; 16],
    /// true if the goal has been stored as the set-point
    #[output]
    complete: bool,
    /// duration of the motion as first planned
    #[output(unit = "s")]
    duration: f64,
    /// time from the start to the first set-point: the interval of this block
    #[param(default = 0.02, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// true: the goal is relative to the position at the start of the motion
    #[param(default = false)]
    relative: bool,
    /// the goal has been stored as the set-point
    #[condition]
    finished: Condition,
    /// the joints are at rest because they are held
    #[condition]
    held: Condition,
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
    wanted: JointGoals,
    is_holding: bool,
    /// Positions to which a relative goal is added.
    origin: [f64; 16],
    span: Span,
    /// True if the joints are coming to rest because time was lost.
    is_lost: bool,
}

/// Goals and limits of each joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct JointGoals {
    goal: [f64; 16],
    speed: [f64; 16],
    acceleration: [f64; 16],
    jerk: [f64; 16],
}

impl Step for MotionGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let first = !self.way.span.begun();
        let mut ahead_s = 0.0;
        if first {
            let last = crate::takeover::last_setpoints!(self, n);
            let Some(begun) = last.begin(invocation.now_ns, self.lead) else { return Outcome::Fault(NOT_FINITE) };
            (self.way.motion, ahead_s, self.way.origin) = (begun.motion, begun.ahead_s, std::array::from_fn(|i| begun.motion.state(i).position));
        }
        let Some(rate) = pace::allowed(&self.r#override[..n], &self.cell_override[..n]) else { return Outcome::Fault(BAD_LIMIT) };
        let wanted = match self.wanted(n, rate) {
            Ok(wanted) => wanted,
            Err(code) => return Outcome::Fault(code),
        };
        let passed = self.way.span.pass(invocation);
        if pace::note_lost(passed, &self.gap_max[..n], &mut self.lost) {
            self.way.is_lost = true;
        }
        let holding = self.holding || rate == 0.0 || self.way.is_lost;
        if first || wanted != self.way.wanted || holding != self.way.is_holding {
            (self.way.wanted, self.way.is_holding) = (wanted, holding);
            self.plan(n);
            if first {
                self.duration = self.way.motion.left_s();
            }
        }
        self.way.motion.advance(if first { ahead_s } else { passed.cycle_s() });
        self.setpoint_time = [invocation.now_ns; 16];
        self.store(n);
        Outcome::Done
    }
}

impl MotionGenerator {
    /// Returns the currently requested goals and limits; the error is a fault code.
    fn wanted(&mut self, n: usize, rate: f64) -> Result<JointGoals, u32> {
        let mut wanted = JointGoals::default();
        for i in 0..n {
            let goal = if self.relative { self.way.origin[i] + self.goal[i] } else { self.goal[i] };
            if !goal.is_finite() {
                return Err(NOT_FINITE);
            }
            if !(self.position_min[i]..=self.position_max[i]).contains(&goal) {
                return Err(OUT_OF_RANGE);
            }
            let limits = [self.speed[i], self.fastest, self.acceleration[i], self.jerk[i]];
            if !limits.iter().all(|limit| limit.is_finite() && *limit > 0.0) {
                return Err(BAD_LIMIT);
            }
            self.target[i] = goal;
            (wanted.goal[i], wanted.speed[i]) = (goal, self.speed[i].min(self.fastest) * rate);
            (wanted.acceleration[i], wanted.jerk[i]) = (self.acceleration[i], self.jerk[i]);
        }
        Ok(wanted)
    }

    fn plan(&mut self, n: usize) {
        let JointGoals { goal, speed, acceleration, jerk } = self.way.wanted;
        let limits: [Limits; 16] = std::array::from_fn(|i| Limits { speed: speed[i], acceleration: acceleration[i], jerk: jerk[i] });
        if self.way.is_holding {
            self.way.motion.stop(&limits[..n]);
        } else {
            self.way.motion.go(&goal[..n], &limits[..n]);
        }
    }

    fn store(&mut self, n: usize) {
        for i in 0..n {
            let state = self.way.motion.state(i);
            (self.setpoint[i], self.velocity[i], self.setpoint_acceleration[i]) = (state.position, state.velocity, state.acceleration);
        }
        let rests = self.way.motion.left_s() == 0.0;
        if self.way.is_lost && rests {
            // The joints may resume, if the gap does not end the motion.
            self.way.is_lost = false;
            self.gap.report(self.lost);
        }
        self.complete = rests && self.setpoint[..n] == self.target[..n];
        if self.complete {
            self.finished.report();
        }
        if rests && self.way.is_holding {
            self.held.report();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generator(start: [f64; 2], goal: [f64; 2]) -> MotionGenerator {
        let wide = |values: [f64; 2]| std::array::from_fn(|i| values.get(i).copied().unwrap_or(f64::NAN));
        MotionGenerator {
            n: 2, start: wide(start), start_velocity: [0.0; 16], last_velocity: [0.0; 16], last_acceleration: [0.0; 16], last_time: [i64::MIN; 16], braking: [[0.0; 4]; 16], fastest: 1e6,
            gap_max: [0.5; 16], setpoint_acceleration: [0.0; 16], setpoint_time: [0; 16], lost: 0.0, gap: ConditionOf::new(0.0), goal: wide(goal), speed: [0.5; 16], acceleration: [2.0; 16], jerk: [20.0; 16],
            position_min: [-6.3; 16], position_max: [6.3; 16], r#override: [1.0; 16], cell_override: [1.0; 16], holding: false, setpoint: [0.0; 16],
            velocity: [0.0; 16], target: [0.0; 16], complete: false, duration: 0.0, lead: 0.02, relative: false, finished: Condition::new(),
            held: Condition::new(), way: Way::default(),
        }
    }

    /// Invokes the block every 20 ms until the goal is stored, at most 1000 times, and returns the number of invocations. `before`
    /// changes the inputs before each invocation. Checks that every step stays within the limits.
    fn run(block: &mut MotionGenerator, mut before: impl FnMut(i64, &mut MotionGenerator)) -> i64 {
        let (mut at, mut rate) = (block.start, block.start_velocity);
        for k in 0..1000 {
            before(k, block);
            (block.finished, block.held) = (Condition::new(), Condition::new());
            assert_eq!(block.step(&Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }), Outcome::Done);
            for i in 0..2 {
                let speed = (block.setpoint[i] - at[i]) / 0.02;
                assert!(speed.abs() <= 0.5 + 1e-9, "joint {i}: {speed} rad/s at {k}");
                assert!((speed - rate[i]).abs() <= 2.0 * 0.02 + 1e-9, "joint {i}: from {} to {speed} rad/s at {k}", rate[i]);
                (at[i], rate[i]) = (block.setpoint[i], speed);
            }
            if block.finished.is_reported() {
                assert!(block.complete && block.setpoint[..2] == block.target[..2]);
                return k;
            }
        }
        1000
    }

    #[test]
    fn it_ends_exactly_at_the_goal_when_it_said() {
        let mut block = generator([0.0, 1.0], [1.0, 0.5]);
        let k = run(&mut block, |_, _| ());
        // 1/0.5 + 0.5/2 + 2/20 s.
        assert!((block.duration - 2.35).abs() < 1e-9);
        assert_eq!((k, block.setpoint[0], block.setpoint[1]), (117, 1.0, 0.5), "the first set-point is one interval ahead");
    }

    #[test]
    fn override_holding_and_another_goal_change_it_smoothly() {
        let mut block = generator([0.0, 1.0], [1.0, 0.5]);
        let mut held = 0;
        let k = run(&mut block, |k, b| {
            held += i32::from(b.held.is_reported());
            b.r#override[1] = if k >= 30 { 0.25 } else { 1.0 };
            b.holding = (60..120).contains(&k);
            b.cell_override[0] = if (150..170).contains(&k) { 0.0 } else { 1.0 };
            if k == 200 {
                b.goal[0] = -0.2;
            }
        });
        assert!(k > 300 && held > 40, "{k} invocations, held in {held}");
        assert_eq!((block.setpoint[0], block.setpoint[1]), (-0.2, 0.5));
    }

    #[test]
    fn it_goes_on_from_a_moving_start_and_counts_from_where_it_began() {
        let mut block = generator([0.0, 1.0], [0.5, -1.0]);
        (block.start_velocity[0], block.start_velocity[1], block.relative) = (-0.4, 0.3, true);
        run(&mut block, |_, _| ());
        assert_eq!((block.setpoint[0], block.setpoint[1]), (0.5, 0.0));
    }

    #[test]
    fn lost_time_is_not_made_up_for_and_a_gap_brings_the_joints_to_rest() {
        for (lost, ends) in [(1, false), (15, false), (40, true), (500, true)] {
            let mut block = generator([0.0, 1.0], [1.0, 0.5]);
            let (mut before, mut speed, mut gap) = (0.0, 0.0, None);
            for k in 0..400u64 {
                let number = if k > 60 { k + lost } else { k };
                block.gap = ConditionOf::new(0.0);
                assert_eq!(block.step(&Invocation { number, time_ns: number as i64 * 20_000_000, now_ns: 0 }), Outcome::Done);
                gap = gap.or(block.gap.is_reported().then_some((k, block.gap.value)));
                let now = block.setpoint[0] - before;
                assert!(now <= 0.5 * 0.02 + 1e-9 && (now - speed).abs() <= 2.0 * 4e-4 + 1e-9, "{now} after {lost} lost cycles at {k}");
                (before, speed) = (block.setpoint[0], now);
            }
            let lost_s = lost as f64 * 0.02;
            assert!((block.lost - lost_s).abs() < 1e-9);
            assert_eq!(gap.is_some(), ends, "{lost} cycles");
            if let Some((k, value)) = gap {
                assert!((62..100).contains(&k) && (value - lost_s).abs() < 1e-9);
            }
            assert_eq!(block.setpoint[0], 1.0, "nothing ended it: it went on");
        }
    }

    #[test]
    fn what_cannot_be_done_is_a_fault_with_its_code() {
        let fault = |change: fn(&mut MotionGenerator)| {
            let mut block = generator([0.0, 1.0], [1.0, 0.5]);
            change(&mut block);
            block.step(&Invocation::default())
        };
        assert_eq!(fault(|b| b.start_velocity[1] = f64::NAN), Outcome::Fault(NOT_FINITE));
        assert_eq!(fault(|b| b.goal[1] = f64::INFINITY), Outcome::Fault(NOT_FINITE));
        assert_eq!(fault(|b| b.speed[0] = 0.0), Outcome::Fault(BAD_LIMIT));
        assert_eq!(fault(|b| b.r#override[0] = 1.1), Outcome::Fault(BAD_LIMIT));
        assert_eq!(fault(|b| b.goal[0] = 90.0), Outcome::Fault(OUT_OF_RANGE));
        assert_eq!(fault(|_| ()), Outcome::Done);
    }
}
