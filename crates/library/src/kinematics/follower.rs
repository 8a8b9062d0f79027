// SPDX-License-Identifier: Apache-2.0
//! What the generators of tool motion share: the path time passes at a pace, and the joints follow by inverse kinematics.
use super::JOINTS_MAX;
use super::chain::Arm;
use super::inverse::{Ranges, inverse};
use super::line::ON_THE_LINE;
use super::pose::Pose;
use crate::pace;

/// How often a step that a joint cannot make is halved before the motion ends.
const HALVINGS: u32 = 6;
const ANYWHERE: Ranges = Ranges { least: &[f64::NEG_INFINITY; JOINTS_MAX], greatest: &[f64::INFINITY; JOINTS_MAX] };

/// Where a motion is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Follower {
    /// Which plan is under way.
    plan: f64,
    /// Its time, s, and how fast that passes.
    pub time_s: f64,
    pub pace: f64,
    before_ns: i64,
    /// Joint positions of the invocation before.
    pub q: [f64; JOINTS_MAX],
}

/// A stretch of path time: from where, for how long, the pace at its beginning and end, and the slope between.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    pub time_s: f64,
    pub way_s: f64,
    pub pace: f64,
    pub after: f64,
    pub slope: f64,
}

impl Follower {
    /// Begins where a plan is new; the time since the invocation before, s. At the beginning the planned speed is 0: any pace will do.
    pub fn begin(&mut self, plan: f64, from: &[f64; JOINTS_MAX], wanted: f64, time_ns: i64) -> f64 {
        if plan != self.plan {
            *self = Follower { plan, time_s: 0.0, pace: wanted, before_ns: time_ns, q: *from };
        }
        let span_s = (time_ns - self.before_ns) as f64 * 1e-9;
        self.before_ns = time_ns;
        span_s
    }

    /// Advances the path time by `span_s` at the pace that is wanted, as far as `fits` and the maximum joint speeds allow. False: no joint
    /// could follow, and nothing has changed but that it stands.
    pub fn go_on(&mut self, arm: &Arm, span_s: f64, wanted: f64, speed_max: &[f64], pose: impl Fn(f64) -> Pose, fits: impl Fn(Stretch) -> bool) -> bool {
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
