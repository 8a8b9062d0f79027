// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::follower::{FollowerInputs, Follower, Stretch, Way, check};
use crate::kinematics::line::Line;
use crate::kinematics::pose::Pose;
use crate::kinematics::{BAD_CHAIN, BAD_POSE, JOINTS_MAX};
use crate::pace;
use crate::profile::{duration_s, evaluate};
use crate::takeover::Brake;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// Line generator: setpoint = q with forward(q) = pose(s(τ)) of a planned line or arc, τ being running time scaled by the override.
///
/// The joint positions are tracked from those of the previous invocation, so the arm keeps its posture. No joint is commanded a step that
/// exceeds its maximum speed: the pace is reduced first, and if that does not help, `singular` is reported and the set-point no longer
/// changes. Joints that move at the start are braked first, each on its own, and the planner plans from the positions where they come to
/// rest. `override` scales the speed (0 holds), `holding` ramps down to rest and reports `held`; both change the pace no faster than the
/// line's acceleration allows. The last set-point is exactly the planned end. Time lost because releases were skipped is not made up for;
/// if the time lost in a single gap exceeds `gap_max`, the motion comes to rest and `gap` is reported. Faults: 1 the arm is not a chain
/// of n joints, or the line was planned for a different number of joints; 2 the start of the line is invalid; 3 an override is not
/// between 0 and 1; 4 there is no line.
#[derive(FunctionBlock)]
pub struct LineGenerator {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// the planned line or arc
    #[input(asynchronous)]
    line: Line,
    /// current commanded positions of the joints, rad or m
    #[input(asynchronous, default = [0.0; 16], sized, range = "[-inf, inf)")]
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
    /// permitted fraction of the speed, 0 to 1; the minimum over the joints applies to all
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    r#override: [f64; 16],
    /// override of the whole cell; the two are multiplied
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    cell_override: [f64; 16],
    /// true: come to rest and wait
    #[input(asynchronous, default = false)]
    holding: bool,
    /// maximum time lost in a single gap; if it is exceeded, the motion comes to rest
    #[input(asynchronous, default = [0.5; 16], sized, unit = "s", range = "(0, inf)")]
    gap_max: [f64; 16],
    /// maximum speed of each joint
    #[input(asynchronous, default = [1e6; 16], sized, range = "(0, inf)")]
    speed_max: [f64; 16],
    /// maximum acceleration for braking joints that move at the start
    #[input(asynchronous, default = [5.0; 16], sized, range = "(0, inf)")]
    acceleration_max: [f64; 16],
    /// maximum jerk for braking joints that move at the start
    #[input(asynchronous, default = [50.0; 16], sized, range = "(0, inf)")]
    jerk_max: [f64; 16],
    /// commanded positions of the joints, rad or m
    #[output(sized)]
    setpoint: [f64; 16],
    /// commanded speed at the set-point, rad/s or m/s
    #[output(sized)]
    setpoint_velocity: [f64; 16],
    /// acceleration of the set-points, rad/s^2 or m/s^2
    #[output(sized)]
    setpoint_acceleration: [f64; 16],
    /// time at which the set-points are stored, ns of the system clock
    #[output(sized)]
    setpoint_time: [i64; 16],
    /// longest time lost in a single gap so far
    #[output(unit = "s")]
    lost: f64,
    /// commanded pose of the tool: x y z in m, quaternion w x y z
    #[output]
    pose: [f64; 7],
    /// completed fraction of the line, 0 to 1
    #[output]
    progress: f64,
    /// true if the last set-point has been stored
    #[output]
    complete: bool,
    /// time between two set-points
    #[param(default = 0.02, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// the last set-point has been stored
    #[condition]
    finished: Condition,
    /// the motion is at rest because of `holding`
    #[condition]
    held: Condition,
    /// the arm cannot follow the line beyond this point; the value is the completed fraction, 0 to 1
    #[condition]
    singular: ConditionOf<f64>,
    /// the motion is at rest because the time lost in a single gap exceeded `gap_max`; the value is the time lost, s
    #[condition]
    gap: ConditionOf<f64>,
    /// progress of the motion
    #[state(opaque)]
    follower: Follower,
    /// joints that are braked to rest first
    #[state(opaque)]
    brake: Brake,
}

impl Step for LineGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let last = crate::takeover::last_setpoints!(self, n);
        let (acceleration, jerk, has_plan) = (&self.acceleration_max[..n], &self.jerk_max[..n], self.line.plan >= 1.0);
        if let Some(now) = self.brake.step(&last, acceleration, jerk, self.lead, has_plan, invocation) {
            (self.setpoint, self.setpoint_velocity, self.setpoint_acceleration) = (now.setpoint, now.velocity, now.acceleration);
            (self.setpoint_time, self.complete) = ([invocation.now_ns; 16], false);
            if now.is_at_rest && self.holding {
                self.held.report();
            }
            return Outcome::Done;
        }
        let (chain, line) = (self.chain, self.line);
        let Some(arm) = chain.read(n) else { return Outcome::Fault(BAD_CHAIN) };
        if let Err(code) = check(line.plan, line.joints, n) {
            return Outcome::Fault(code);
        }
        let Some(way) = DrawnLine::of(&line) else { return Outcome::Fault(BAD_POSE) };
        let asked = FollowerInputs {
            r#override: &self.r#override[..n], cell_override: &self.cell_override[..n], holding: self.holding, speed_max: &self.speed_max[..n],
            gap_max: &self.gap_max[..n], invocation,
        };
        let now = match self.follower.follow(&arm, &way, &asked, &mut self.lost) {
            Ok(now) => now,
            Err(code) => return Outcome::Fault(code),
        };
        (self.setpoint, self.pose, self.progress, self.complete) = (now.setpoint, now.pose, now.progress, now.complete);
        (self.setpoint_velocity, self.setpoint_acceleration, self.setpoint_time) = (now.velocity, now.acceleration, [invocation.now_ns; 16]);
        now.report(&mut self.finished, &mut self.held, &mut self.singular, &mut self.gap);
        Outcome::Done
    }
}

/// A line together with its parsed start pose.
struct DrawnLine<'a> {
    line: &'a Line,
    start: Pose,
}

impl DrawnLine<'_> {
    /// Parses the start pose of a line. Returns `None` if its quaternion is not a unit quaternion.
    fn of(line: &Line) -> Option<DrawnLine<'_>> {
        Some(DrawnLine { line, start: Pose::of(&line.course.start)? })
    }

    /// Returns s and its rate at a time.
    fn along(&self, time_s: f64) -> (f64, f64) {
        let (mut s, mut rate) = ([0.0], [0.0]);
        evaluate(&self.line.profile, time_s, &mut s, &mut rate);
        (s[0], rate[0])
    }
}

impl Way for DrawnLine<'_> {
    fn plan(&self) -> f64 {
        self.line.plan
    }

    fn ends(&self) -> (&[f64; JOINTS_MAX], &[f64; JOINTS_MAX]) {
        (&self.line.from, &self.line.to)
    }

    fn duration_s(&self) -> f64 {
        duration_s(&self.line.profile)
    }

    fn progress(&self, time_s: f64) -> f64 {
        self.along(time_s).0
    }

    fn pose(&self, time_s: f64) -> Pose {
        self.line.course.at(&self.start, self.along(time_s).0)
    }

    fn allows(&self, stretch: Stretch) -> bool {
        let (begin, end) = (self.along(stretch.time_s).1, self.along(stretch.time_s + stretch.way_s).1);
        let planned = if stretch.way_s > 0.0 { (end - begin) / stretch.way_s } else { 0.0 };
        let fits = |rate, at| pace::within(pace::acceleration(rate, planned, at, stretch.slope), self.line.slope);
        fits(begin, stretch.pace) && fits(end, stretch.after)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::kinematics::NO_PLAN;
    use crate::kinematics::chain::samples::{HOME, six_joints};
    use crate::kinematics::course::Course;
    use crate::kinematics::inverse::Ranges;
    use crate::kinematics::line::{Obstacle, Wish, plan_line};
    use crate::kinematics::pose::{cross, length, product, subtract, turn};
    use crate::path::samples::numbers;
    use crate::profile::Limits;
    use std::f64::consts::FRAC_PI_2;

    const LINEAR: Limits = Limits { speed: 0.25, acceleration: 1.0, jerk: 10.0 };
    const ANGULAR: Limits = Limits { speed: 1.0, acceleration: 5.0, jerk: 50.0 };
    pub(crate) const JOINT: Limits = Limits { speed: 3.0, acceleration: 5.0, jerk: 1.0 };

    fn planned(chain: &Chain, from: &[f64; 6], goal: Pose, most: f64) -> Result<Line, Obstacle> {
        let arm = chain.read(6).expect("a chain");
        let ranges = Ranges { min: &[-6.3; 6], max: &[most; 6] };
        let course = Course::straight(&arm.posture(from).tool, &goal);
        plan_line(1.0, &arm, &course, &Wish { from, goal, linear: LINEAR, angular: ANGULAR, joints: &[JOINT; 6], ranges, slowest: 0.02 })
    }

    fn generator(line: Line) -> LineGenerator {
        LineGenerator {
            n: 6, line, r#override: [1.0; 16], cell_override: [1.0; 16], holding: false, speed_max: [3.0; 16], setpoint: [0.0; 16], pose: [0.0; 7], progress: 0.0, complete: false,
            chain: six_joints(), finished: Condition::new(), held: Condition::new(), singular: ConditionOf::new(0.0), gap: ConditionOf::new(0.0), start: [0.0; 16], start_velocity: [0.0; 16], last_velocity: [0.0; 16], last_acceleration: [0.0; 16], last_time: [i64::MIN; 16], braking: [[0.0; 4]; 16], acceleration_max: [5.0; 16], jerk_max: [50.0; 16], lead: 0.02,
            brake: Brake::default(), gap_max: [0.5; 16], setpoint_velocity: [0.0; 16], setpoint_acceleration: [0.0; 16], setpoint_time: [0; 16], lost: 0.0,
            follower: Follower::default(),
        }
    }

    /// Runs a line to its end, checking that the tool is on it and that no joint exceeds its maximum speed. Returns the poses of the
    /// tool.
    fn run(line: Line, mut change: impl FnMut(i64, &mut LineGenerator)) -> Vec<Pose> {
        let chain = six_joints();
        let arm = chain.read(6).expect("a chain");
        let start = Pose::of(&line.course.start).expect("a pose");
        let mut block = generator(line);
        let mut poses = Vec::new();
        let (mut before, mut speed) = ([0.0; 16], [0.0; 16]);
        for k in 0..5000 {
            change(k, &mut block);
            (block.finished, block.held) = (Condition::new(), Condition::new());
            assert_eq!(block.step(&Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }), Outcome::Done);
            poses.push(arm.posture(&block.setpoint[..6]).tool);
            let (off, turned) = poses[poses.len() - 1].to(&line.course.at(&start, block.progress));
            assert!(length(off) < 1e-6 && length(turned) < 1e-6, "{k}: {off:?} {turned:?}");
            for i in 0..6 {
                let rate = if k == 0 { 0.0 } else { (block.setpoint[i] - before[i]) / 0.02 };
                assert!(rate.abs() <= JOINT.speed && (rate - speed[i]).abs() / 0.02 <= JOINT.acceleration * 1.02, "joint {i} at {k}: {rate}");
                speed[i] = rate;
            }
            before = block.setpoint;
            assert!(!block.singular.is_reported());
            if block.complete {
                assert!(block.finished.is_reported() && block.setpoint == block.line.to);
                return poses;
            }
        }
        panic!("it does not end");
    }

    /// Like `run`, but with random overrides and holds.
    pub(crate) fn disturbed(line: Line, number: &mut impl FnMut(f64, f64) -> f64) -> Vec<Pose> {
        run(line, |k, block| {
            if k % 9 == 0 {
                (block.r#override, block.holding) = ([number(0.0, 1.0); 16], number(0.0, 1.0) < 0.3);
            }
        })
    }

    fn goal_from(way: [f64; 3], angle: f64) -> Pose {
        let chain = six_joints();
        let here = chain.read(6).expect("a chain").posture(&HOME).tool;
        let position = std::array::from_fn(|i| here.position[i] + way[i]);
        Pose { position, quaternion: product(turn([0.0, 0.6, 0.8], angle), here.quaternion) }
    }

    #[test]
    fn the_tool_stays_on_the_line_and_takes_the_time_of_the_speed() {
        let line = planned(&six_joints(), &HOME, goal_from([0.1, -0.2, 0.1], 0.3), 6.3).expect("a line");
        let way = length([0.1, -0.2, 0.1]);
        // way/v + v/a + a/j: the textbook duration of a motion that reaches its speed and acceleration limits.
        let time = way / 0.25 + 0.25 / 1.0 + 1.0 / 10.0;
        assert!((duration_s(&line.profile) - time).abs() < 1e-9);
        let poses = run(line, |_, _| ());
        assert_eq!(poses.len() - 1, (time / 0.02).ceil() as usize);
        let (start, goal) = (poses[0], poses[poses.len() - 1]);
        for pose in poses {
            let off = cross(subtract(pose.position, start.position), subtract(goal.position, start.position));
            assert!(length(off) / way < 1e-6);
        }
    }

    #[test]
    fn override_and_hold_keep_it_on_the_line_and_within_the_limits() {
        let line = planned(&six_joints(), &HOME, goal_from([0.1, -0.25, -0.2], -1.0), 6.3).expect("a line");
        for seed in 1..20 {
            let mut number = numbers(seed);
            disturbed(line, &mut number);
        }
    }

    #[test]
    fn what_is_in_the_way_is_known_before_it_moves() {
        let far = goal_from([1.5, 0.0, 0.0], 0.0);
        let beyond = planned(&six_joints(), &HOME, far, 6.3);
        assert!(matches!(beyond, Err(Obstacle::Unreachable(distance)) if (0.1..0.4).contains(&distance)), "{beyond:?}");
        assert_eq!(planned(&six_joints(), &HOME, goal_from([0.0, -0.1, 0.2], 0.0), FRAC_PI_2).err(), None);
        let limited = planned(&six_joints(), &HOME, goal_from([0.25, 0.0, -0.25], 0.0), 1.58);
        assert!(matches!(limited, Err(Obstacle::Limit(2))), "{limited:?}");
        // Passes through the axis of the first joint: the arm would have to turn round at once.
        let through = planned(&six_joints(), &HOME, goal_from([0.98, 0.27, 0.0], 0.0), 6.3);
        assert!(matches!(through, Err(Obstacle::Singular(_))), "{through:?}");
        // With the wrist straight, the fourth and the sixth joint share one axis.
        let straight = [0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, 1e-9, 0.0];
        let here = six_joints().read(6).expect("a chain").posture(&straight).tool;
        let goal = Pose { quaternion: product(turn([0.0, 0.0, 1.0], 0.5), here.quaternion), ..here };
        let slow = planned(&six_joints(), &straight, goal, 6.3);
        assert!(matches!(slow, Err(Obstacle::Singular(_))), "{slow:?}");
    }

    #[test]
    fn a_joint_that_cannot_follow_slows_the_line_and_never_jumps() {
        let line = planned(&six_joints(), &HOME, goal_from([0.1, -0.2, 0.1], 0.0), 6.3).expect("a line");
        let mut block = LineGenerator { speed_max: [0.1; 16], ..generator(line) };
        let mut before = line.from;
        for k in 0..200 {
            assert_eq!(block.step(&Invocation { number: k, time_ns: k as i64 * 20_000_000, now_ns: 0 }), Outcome::Done);
            assert!((0..6).all(|i| (block.setpoint[i] - before[i]).abs() <= 0.1 * 0.02 * (1.0 + 1e-6)), "{k}");
            before = block.setpoint;
        }
    }

    #[test]
    fn without_a_line_nothing_is_stored() {
        let line = planned(&six_joints(), &HOME, goal_from([0.1, 0.0, 0.0], 0.0), 6.3).expect("a line");
        assert_eq!(generator(Line { plan: 0.0, ..line }).step(&Invocation::default()), Outcome::Fault(NO_PLAN));
        assert_eq!(generator(Line { joints: 5, ..line }).step(&Invocation::default()), Outcome::Fault(BAD_CHAIN));
    }
}
