// SPDX-License-Identifier: Apache-2.0
//! Planning of tool paths: first a path of four coordinates, then inverse kinematics along it, in portions that fit into one invocation.
use super::{PolylineTable, PolylineView, SPACE};
use crate::kinematics::JOINTS_MAX;
use crate::kinematics::chain::Arm;
use crate::kinematics::follower::Way;
use crate::kinematics::line::{Obstacle, Wish, next};
use crate::kinematics::pose::{Numbers, Pose, length};
use crate::path::{Passing, Planning};

/// Minimum number of points of a path at which a plan is checked; also the minimum number per way-point.
const SAMPLES: usize = 512;
const SAMPLES_EACH: usize = 2;
/// Distance below which way-points count as coincident, m and rad.
const SAME: f64 = 1e-8;

/// Progress of planning. The default is idle.
#[derive(Clone, Copy, Debug, Default)]
pub struct PolylinePlanning {
    path: Planning,
    /// True during inverse kinematics along the finished path.
    follows: bool,
    /// Number of points checked, the joint positions and speeds at the last of them, and the factor by which the path must be slowed
    /// down.
    sample: usize,
    here: [f64; JOINTS_MAX],
    rate: [f64; JOINTS_MAX],
    slower: f64,
}

/// Work done in one invocation: number of way-point steps, and number of points to check.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    pub steps: usize,
    pub samples: usize,
}

impl PolylinePlanning {
    /// Begins a path through poses from the current joint positions; `wish.goal` is not used. The caller must have checked that numbers
    /// are finite, quaternions have length 1, limits are positive, and the table has space for the poses. `shares` are the fractions of a
    /// line that one blend may use.
    pub fn begin(
        table: &mut PolylineTable,
        arm: &Arm,
        (poses, shares): (&[Numbers], &[f64]),
        passing: impl Iterator<Item = Passing>,
        wish: &Wish,
    ) -> PolylinePlanning {
        let n = arm.joints();
        *table.joints = n as i32;
        *table.from = [0.0; JOINTS_MAX];
        table.from[..n].copy_from_slice(wish.from);
        let mut here = arm.posture(wish.from).tool;
        let ([x, y, z], mut angle) = (here.position, 0.0);
        table.quaternion[0] = here.quaternion;
        let path = Planning::begin(&mut table.path, SPACE, &[x, y, z, angle], shares);
        for (pose, passing) in poses.iter().filter_map(Pose::of).zip(passing) {
            let Some(turn) = way_on(&here, &pose) else { continue };
            angle += turn;
            let [x, y, z] = pose.position;
            table.path.add(&[x, y, z, angle], passing);
            table.quaternion[*table.path.points as usize - 1] = pose.quaternion;
            here = pose;
        }
        *table.acceleration = [wish.linear.acceleration, wish.angular.acceleration];
        PolylinePlanning { path, slower: 1.0, here: *table.from, ..PolylinePlanning::default() }
    }

    /// Returns true if a path has been begun but is not ready yet.
    pub fn is_under_way(&self) -> bool {
        self.path.is_under_way() || self.follows
    }

    /// Continues planning within the budget. Returns true if the path is ready except for its number. An obstacle ends the planning, and
    /// is returned with the way-point at the end of its line.
    pub fn advance(&mut self, table: &mut PolylineTable, arm: &Arm, wish: &Wish, mut budget: Budget) -> Result<bool, (usize, Obstacle)> {
        if !self.follows {
            let limits = [wish.linear, wish.linear, wish.linear, wish.angular];
            if !self.path.advance(&mut table.path, &limits, &mut budget.steps) {
                return Ok(false);
            }
            self.follows = true;
        }
        let last = *table.path.points as usize - 1;
        let found = self.follow(&table.view(), arm, wish, budget.samples).and_then(|ready| match self.slower > 1.0 / wish.slowest {
            true if ready => Err((last, Obstacle::Singular(1.0 / self.slower))),
            _ => Ok(ready),
        });
        if found == Ok(false) {
            return Ok(false);
        }
        (self.path, self.follows) = (Planning::default(), false);
        found?;
        *table.to = self.here;
        table.path.stretch(self.slower);
        *table.acceleration = table.acceleration.map(|a| a / (self.slower * self.slower));
        Ok(true)
    }

    /// Follows the path by inverse kinematics to its end, and computes the factor by which it must be slowed down so that no joint
    /// exceeds its limits. Returns true when the end has been reached.
    fn follow(&mut self, line: &PolylineView, arm: &Arm, wish: &Wish, samples: usize) -> Result<bool, (usize, Obstacle)> {
        let all = SAMPLES.max(SAMPLES_EACH * (line.path.points - 1));
        let span = line.path.duration / all as f64;
        if span <= 0.0 {
            return Ok(true);
        }
        let end = all.min(self.sample.saturating_add(samples));
        for k in self.sample + 1..=end {
            let (pose, at) = (line.pose(k as f64 * span), line.before(k as f64 * span));
            let [x, y, z, ..] = line.path.q[at];
            let goal = Pose { position: [x, y, z], quaternion: line.quaternion[at] };
            let ahead = next(arm, &pose, &self.here, &Wish { goal, ..*wish }).map_err(|what| (at, what))?;
            for (i, limit) in wish.joints.iter().enumerate() {
                let speed = (ahead[i] - self.here[i]) / span;
                self.slower = self.slower.max(speed.abs() / limit.speed).max(((speed - self.rate[i]).abs() / span / limit.acceleration).sqrt());
                self.rate[i] = speed;
            }
            self.here = ahead;
        }
        self.sample = end;
        Ok(end == all)
    }
}

impl PolylineTable<'_> {
    /// Returns a view for reading the path.
    fn view(&self) -> PolylineView<'_> {
        PolylineView { path: self.path.view(), quaternion: self.quaternion, from: self.from, to: self.to, acceleration: *self.acceleration }
    }
}

/// Returns the angle by which the tool rotates between two poses; `None` if they coincide.
fn way_on(here: &Pose, pose: &Pose) -> Option<f64> {
    let (way, turn) = here.to(pose);
    (length(way) >= SAME || length(turn) >= SAME).then(|| length(turn))
}

/// Returns the index of the pose that is way-point `at` of a path from `start`. A pose that repeats the previous one is not a way-point.
pub fn which(start: Pose, poses: &[Numbers], at: usize) -> usize {
    let (mut here, mut count) = (start, 0);
    for (k, pose) in poses.iter().enumerate() {
        let Some(pose) = Pose::of(pose).filter(|pose| way_on(&here, pose).is_some()) else { continue };
        (here, count) = (pose, count + 1);
        if count == at {
            return k;
        }
    }
    0
}
