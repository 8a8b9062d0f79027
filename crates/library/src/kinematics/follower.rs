// SPDX-License-Identifier: Apache-2.0
//! Common part of the generators of tool motions: path time advances at a pace, and the joints follow by inverse kinematics.
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

/// Number of times that an infeasible joint step is halved before the motion ends.
const HALVINGS: u32 = 6;
const ANYWHERE: Ranges = Ranges { min: &[f64::NEG_INFINITY; JOINTS_MAX], max: &[f64::INFINITY; JOINTS_MAX] };

/// Progress of a motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Follower {
    /// Number of the plan being executed.
    plan: f64,
    /// Path time, s, followed by its pace.
    time_s: f64,
    pace: f64,
    span: Span,
    /// True if the motion is coming to rest because time was lost.
    is_lost: bool,
    /// Joint positions in the previous invocation.
    q: [f64; JOINTS_MAX],
    tail: Tail,
}

/// Segment of path time: its start and duration, the pace at its start and end, and the slope of the pace in between.
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
    /// Returns the joint positions at the start and at the end.
    fn ends(&self) -> (&[f64; JOINTS_MAX], &[f64; JOINTS_MAX]);
    /// Returns the planned duration, s.
    fn duration_s(&self) -> f64;
    /// Returns the completed fraction of the motion at a path time, 0 to 1.
    fn progress(&self, time_s: f64) -> f64;
    /// Returns the commanded pose of the tool at a path time.
    fn pose(&self, time_s: f64) -> Pose;
    /// Returns true if the acceleration limits allow this change of pace over the segment.
    fn allows(&self, stretch: Stretch) -> bool;
}

/// Inputs of one invocation of a generator; each slice has one element per joint.
#[derive(Clone, Copy, Debug)]
pub struct FollowerInputs<'a> {
    pub r#override: &'a [f64],
    pub cell_override: &'a [f64],
    pub holding: bool,
    pub speed_max: &'a [f64],
    /// Maximum time lost in a single gap, s.
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
    /// True if the last set-point has been stored.
    pub complete: bool,
    /// True if the motion is at rest as requested.
    pub held: bool,
    /// Completed fraction, 0 to 1, at which the arm cannot continue to follow the motion.
    pub singular: Option<f64>,
    /// Time lost, s, if the motion is at rest because the time lost in a single gap exceeded the maximum.
    pub gap_s: Option<f64>,
}

impl FollowerOutputs {
    /// Reports the conditions that have become true.
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

/// Checks that there is a plan for `n` joints; the error is a fault code.
pub fn check(plan: f64, joints: i32, n: usize) -> Result<(), u32> {
    match plan {
        plan if plan < 1.0 => Err(NO_PLAN),
        _ if joints != n as i32 => Err(BAD_CHAIN),
        _ => Ok(()),
    }
}

impl Follower {
    /// Performs one invocation of a generator: path time advances at the pace that the overrides allow, or comes to rest, and the joints
    /// follow.
    ///
    /// # Errors
    /// Returns a fault code if an override is not between 0 and 1.
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
        // The motion may resume, if the gap does not end it.
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

    /// Starts a new plan, if there is one. Returns the time since the previous invocation. At the start, the planned speed is 0, so any
    /// pace is permitted.
    fn begin(&mut self, plan: f64, from: &[f64; JOINTS_MAX], wanted: f64, invocation: &Invocation) -> ElapsedTime {
        if plan != self.plan {
            *self = Follower { plan, pace: wanted, q: *from, ..Follower::default() };
        }
        self.span.pass(invocation)
    }

    /// Advances the path time by `span_s` at the requested pace, as far as `fits` and the maximum joint speeds allow. Returns false if
    /// the joints cannot follow: the motion then stops, and nothing else changes.
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
