// SPDX-License-Identifier: Apache-2.0
//! Common part of the generators of tool motion: the path time passes at a pace, and the joints follow by inverse kinematics.
use super::JOINTS_MAX;
use super::chain::Arm;
use super::inverse::{Ranges, inverse};
use super::line::ON_THE_LINE;
use super::pose::{Numbers, Pose};
use super::{BAD_CHAIN, BAD_LIMIT, NO_PLAN};
use crate::pace;
use crate::span::{ElapsedTime, Span};
use crate::takeover::Tail;
use opengpac::{Condition, ConditionOf, Invocation};

/// Number of times that a step that a joint cannot make is halved before the motion ends.
const HALVINGS: u32 = 6;
const ANYWHERE: Ranges = Ranges { min: &[f64::NEG_INFINITY; JOINTS_MAX], max: &[f64::INFINITY; JOINTS_MAX] };

/// Progress of a motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Follower {
    /// Number of the plan under way.
    plan: f64,
    /// Its time, s, and how fast that passes.
    time_s: f64,
    pace: f64,
    span: Span,
    /// It comes to rest because time was lost.
    is_lost: bool,
    /// Joint positions of the invocation before.
    q: [f64; JOINTS_MAX],
    tail: Tail,
}

/// Segment of path time: its start and duration, the pace at its beginning and end, and the slope between.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    pub time_s: f64,
    pub way_s: f64,
    pub pace: f64,
    pub after: f64,
    pub slope: f64,
}

/// A planned motion of the tool, which a generator follows.
pub trait Way {
    /// Returns the number of the plan: 1, 2, …
    fn plan(&self) -> f64;
    /// Joint positions at its beginning and at its end.
    fn ends(&self) -> (&[f64; JOINTS_MAX], &[f64; JOINTS_MAX]);
    /// Returns its planned duration, s.
    fn duration_s(&self) -> f64;
    /// The part of it that is done at a time of its own, 0 to 1.
    fn progress(&self, time_s: f64) -> f64;
    /// Returns the pose at which the tool is to be at a time of its own.
    fn pose(&self, time_s: f64) -> Pose;
    /// Returns true if its accelerations allow a segment of it to be passed at a pace that changes so.
    fn allows(&self, stretch: Stretch) -> bool;
}

/// Inputs of one invocation of a generator, a number for each joint.
#[derive(Clone, Copy, Debug)]
pub struct FollowerInputs<'a> {
    pub r#override: &'a [f64],
    pub cell_override: &'a [f64],
    pub holding: bool,
    pub speed_max: &'a [f64],
    /// Time that may be lost at once, s.
    pub gap_max: &'a [f64],
    pub invocation: &'a Invocation,
}

/// Outputs of one invocation of a generator.
#[derive(Clone, Copy, Debug)]
pub struct FollowerOutputs {
    pub setpoint: [f64; JOINTS_MAX],
    pub velocity: [f64; JOINTS_MAX],
    pub acceleration: [f64; JOINTS_MAX],
    pub pose: Numbers,
    pub progress: f64,
    /// The last set-point is stored.
    pub complete: bool,
    /// It rests, as it was asked to.
    pub held: bool,
    /// The arm cannot follow from here: how much is done, 0 to 1.
    pub singular: Option<f64>,
    /// It rests because more time was lost at once than is allowed: how much, s.
    pub gap_s: Option<f64>,
}

impl FollowerOutputs {
    /// Reports the conditions that have come.
    pub fn report(&self, finished: &mut Condition, held: &mut Condition, singular: &mut ConditionOf<f64>, gap: &mut ConditionOf<f64>) {
        if let Some(gap_s) = self.gap_s {
            gap.report(gap_s);
        }
        if self.complete {
            finished.report();
        }
        if self.held {
            held.report();
        }
        if let Some(done) = self.singular {
            singular.report(done);
        }
    }
}

/// Checks that there is a plan, and one for `n` joints; the error is the code of a fault.
pub fn check(plan: f64, joints: i32, n: usize) -> Result<(), u32> {
    match plan {
        plan if plan < 1.0 => Err(NO_PLAN),
        _ if joints != n as i32 => Err(BAD_CHAIN),
        _ => Ok(()),
    }
}

impl Follower {
    /// One invocation of a generator: path time passes at the pace that the overrides allow, or comes to rest, and the joints follow.
    ///
    /// # Errors
    /// The code of a fault: an override is not within 0 and 1.
    pub fn follow(&mut self, arm: &Arm, way: &impl Way, asked: &FollowerInputs, lost: &mut f64) -> Result<FollowerOutputs, u32> {
        let allowed = pace::allowed(asked.r#override, asked.cell_override).ok_or(BAD_LIMIT)?;
        let (from, to) = way.ends();
        let passed = self.begin(way.plan(), from, if asked.holding { 0.0 } else { allowed }, asked.invocation);
        self.is_lost |= pace::note_lost(passed, asked.gap_max, lost);
        let wanted = if asked.holding || self.is_lost { 0.0 } else { allowed };
        let span_s = passed.cycle_s();
        let is_followed = self.go_on(arm, span_s, wanted, asked.speed_max, |time_s| way.pose(time_s), |stretch| way.allows(stretch));
        let progress = way.progress(self.time_s);
        let complete = self.time_s >= way.duration_s();
        if complete {
            self.q = *to;
        }
        let gap_s = (self.is_lost && (self.pace == 0.0 || complete)).then_some(*lost);
        // It may go on, where that does not end the motion.
        self.is_lost &= gap_s.is_none();
        let (mut velocity, mut acceleration) = ([0.0; JOINTS_MAX], [0.0; JOINTS_MAX]);
        self.tail.push(&self.q, span_s, complete || self.pace == 0.0, &mut velocity, &mut acceleration);
        Ok(FollowerOutputs {
            setpoint: self.q,
            velocity,
            acceleration,
            gap_s,
            pose: way.pose(self.time_s).numbers(),
            progress,
            complete,
            held: asked.holding && (self.pace == 0.0 || complete),
            singular: (!is_followed).then_some(progress),
        })
    }

    /// Begins where a plan is new; the time since the invocation before. At the beginning the planned speed is 0: any pace will do.
    fn begin(&mut self, plan: f64, from: &[f64; JOINTS_MAX], wanted: f64, invocation: &Invocation) -> ElapsedTime {
        if plan != self.plan {
            *self = Follower { plan, pace: wanted, q: *from, ..Follower::default() };
        }
        self.span.pass(invocation)
    }

    /// Advances the path time by `span_s` at the pace that is wanted, as far as `fits` and the maximum joint speeds allow. False: no joint
    /// could follow, and nothing has changed but that it stands.
    fn go_on(&mut self, arm: &Arm, span_s: f64, wanted: f64, speed_max: &[f64], pose: impl Fn(f64) -> Pose, fits: impl Fn(Stretch) -> bool) -> bool {
        if span_s <= 0.0 {
            return true;
        }
        let (pace, time_s) = (self.pace, self.time_s);
        let mut after = pace::next(pace, wanted, span_s, |after, slope| fits(Stretch { time_s, way_s: span_s * (pace + after) / 2.0, pace, after, slope }));
        let mut way_s = span_s * (pace + after) / 2.0;
        for _ in 0..HALVINGS {
            let found = inverse(arm, &pose(time_s + way_s), &self.q[..arm.joints()], ANYWHERE, ON_THE_LINE);
            let possible = |(i, most): (usize, &f64)| (found.q[i] - self.q[i]).abs() <= most * span_s * (1.0 + 1e-9);
            if found.reached && speed_max.iter().enumerate().all(possible) {
                (self.q, self.time_s, self.pace) = (found.q, time_s + way_s, after);
                return true;
            }
            (way_s, after) = (way_s / 2.0, after / 2.0);
        }
        self.pace = 0.0;
        false
    }
}
