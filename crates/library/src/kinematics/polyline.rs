// SPDX-License-Identifier: Apache-2.0
//! Straight lines of the tool through poses, joined by blends, planned whole before anything moves.
//!
//! The position of the tool goes along a [`Path`] of four coordinates: x, y, z, and the angle by which it has turned since the start, so
//! that the orientation has a speed and an acceleration too. On a line the orientation turns evenly about one axis; in a blend it goes
//! from the one turn into the other as the position does (de Casteljau's construction, with turns for lines). Inverse kinematics follows
//! the whole path beforehand, and the path is slowed down as a whole until no joint exceeds its limits anywhere.
use super::JOINTS_MAX;
use super::chain::Arm;
use super::follower::{Stretch, Way};
use super::line::{Obstacle, Wish, next};
use super::pose::{Numbers, Pose, length};
use crate::path::{POINTS_MAX, Part, Passing, Path, plan_in};
use opengpac::Type;

const ALL: usize = POINTS_MAX + 1;
/// Points of a path at which a plan looks.
const SAMPLES: usize = 512;
/// Points within a period at which a change of the pace is checked.
const PLACES: u32 = 6;
/// Coordinates that are the position, and that of the angle.
const SPACE: usize = 3;
/// Way-points nearer than this, m and rad, are one.
const SAME: f64 = 1e-8;

/// A planned path of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Polyline {
    /// x, y, z (m) and the angle turned (rad) as a path.
    pub path: Path,
    /// Orientation at each way-point, w first.
    pub quaternion: [[f64; 4]; ALL],
    /// Number of joints.
    pub joints: i32,
    /// Joint positions at its beginning.
    pub from: [f64; JOINTS_MAX],
    /// Joint positions at its end.
    pub to: [f64; JOINTS_MAX],
    /// Maximum acceleration of the position (m/s²) and of the angle (rad/s²).
    pub acceleration: [f64; 2],
}

/// Plans path number `number` (from 1) through `poses`; `wish.goal` is not used. The caller has checked that numbers are finite and
/// limits positive. An obstacle comes with the way-point that it is before or at.
pub fn plan_polyline(number: f64, arm: &Arm, poses: &[Pose], passing: &[Passing], wish: &Wish) -> Result<Polyline, (usize, Obstacle)> {
    let n = arm.joints();
    let mut line = <Polyline as Type>::zero();
    line.joints = n as i32;
    line.from[..n].copy_from_slice(wish.from);
    let mut points = [[0.0; JOINTS_MAX]; POINTS_MAX];
    let mut chosen = [Passing { blend: 0.0, speed: 1.0 }; POINTS_MAX];
    let mut which = [0; ALL];
    let (mut here, mut count, mut angle) = (arm.posture(wish.from).tool, 0, 0.0);
    let start = here.position;
    line.quaternion[0] = here.quaternion;
    for (k, (pose, passing)) in poses.iter().zip(passing).enumerate() {
        let (way, turn) = here.to(pose);
        if length(way) < SAME && length(turn) < SAME {
            continue;
        }
        angle += length(turn);
        let [x, y, z] = pose.position;
        points[count][..4].copy_from_slice(&[x, y, z, angle]);
        (chosen[count], which[count + 1]) = (*passing, k);
        count += 1;
        line.quaternion[count] = pose.quaternion;
        here = *pose;
    }
    let limits = [wish.linear, wish.linear, wish.linear, wish.angular];
    line.path = plan_in(SPACE, number, &[start[0], start[1], start[2], 0.0], &points[..count], &chosen[..count], &limits);
    line.acceleration = [wish.linear.acceleration, wish.angular.acceleration];
    let slower = follow(&mut line, arm, wish).map_err(|(at, what)| (which[at], what))?;
    if slower > 1.0 / wish.slowest {
        return Err((which[count], Obstacle::Singular(1.0 / slower)));
    }
    line.path.slow_down(slower);
    line.acceleration = line.acceleration.map(|a| a / (slower * slower));
    Ok(line)
}

/// Follows the path by inverse kinematics, to its end: how much slower it must be so that no joint exceeds its limits.
fn follow(line: &mut Polyline, arm: &Arm, wish: &Wish) -> Result<f64, (usize, Obstacle)> {
    let span = line.path.duration / SAMPLES as f64;
    let mut slower: f64 = 1.0;
    let (mut here, mut rate) = (line.from, [0.0; JOINTS_MAX]);
    for k in 1..=SAMPLES {
        if span <= 0.0 {
            break;
        }
        let (pose, at) = (line.pose(k as f64 * span), line.before(k as f64 * span));
        let [x, y, z, ..] = line.path.q[at];
        let goal = Pose { position: [x, y, z], quaternion: line.quaternion[at] };
        let ahead = next(arm, &pose, &here, &Wish { goal, ..*wish }).map_err(|what| (at, what))?;
        for (i, limit) in wish.joints.iter().enumerate() {
            let speed = (ahead[i] - here[i]) / span;
            slower = slower.max(speed.abs() / limit.speed).max(((speed - rate[i]).abs() / span / limit.acceleration).sqrt());
            rate[i] = speed;
        }
        here = ahead;
    }
    line.to = here;
    Ok(slower)
}

impl Polyline {
    /// The way-point that the path goes to at a time.
    fn before(&self, time_s: f64) -> usize {
        match self.path.part(time_s) {
            Part::Line { after, .. } => after + 1,
            Part::Blend { at, .. } => at,
        }
    }

    /// The orientation at a share of the line after a way-point.
    fn turned(&self, after: usize, share: f64) -> [f64; 4] {
        if self.path.points < 2 { self.quaternion[0] } else { between(self.quaternion[after], self.quaternion[after + 1], share) }
    }

    /// Velocity and acceleration of the position and of the angle at a time, as the limits see them.
    fn motion(&self, time_s: f64) -> ([f64; 4], [f64; 4]) {
        let (mut velocity, mut acceleration) = ([0.0; 4], [0.0; 4]);
        self.path.evaluate(time_s, &mut [0.0; 4], &mut velocity, &mut acceleration);
        (velocity, acceleration)
    }

    /// Returns true if the limits allow the planned motion at a time to pass at a pace that changes at `slope`.
    fn fits(&self, time_s: f64, pace: f64, slope: f64) -> bool {
        let (velocity, planned) = self.motion(time_s);
        let together = crate::pace::acceleration;
        let space: [f64; SPACE] = std::array::from_fn(|i| together(velocity[i], planned[i], pace, slope));
        let angle = together(velocity[SPACE], planned[SPACE], pace, slope);
        crate::pace::within(length(space), self.acceleration[0]) && crate::pace::within(angle, self.acceleration[1])
    }
}

impl Way for Polyline {
    fn plan(&self) -> f64 {
        self.path.plan
    }

    fn ends(&self) -> (&[f64; JOINTS_MAX], &[f64; JOINTS_MAX]) {
        (&self.from, &self.to)
    }

    fn duration_s(&self) -> f64 {
        self.path.duration
    }

    fn progress(&self, time_s: f64) -> f64 {
        if time_s >= self.path.duration { 1.0 } else { time_s / self.path.duration }
    }

    fn pose(&self, time_s: f64) -> Pose {
        let mut place = [0.0; SPACE + 1];
        self.path.evaluate(time_s, &mut place, &mut [0.0; SPACE + 1], &mut [0.0; SPACE + 1]);
        let quaternion = match self.path.part(time_s) {
            Part::Line { after, share } => self.turned(after, share),
            Part::Blend { at, share, before, behind } => {
                let (begin, end) = (self.turned(at - 1, before), self.turned(at, behind));
                let corner = self.quaternion[at];
                between(between(begin, corner, share), between(corner, end, share), share)
            }
        };
        Pose { position: [place[0], place[1], place[2]], quaternion }
    }

    fn allows(&self, stretch: Stretch) -> bool {
        (0..=PLACES).all(|k| {
            let share = f64::from(k) / f64::from(PLACES);
            self.fits(stretch.time_s + stretch.way_s * share, stretch.pace + (stretch.after - stretch.pace) * share, stretch.slope)
        })
    }
}

/// From one orientation a share of the shorter turn to another.
fn between(from: [f64; 4], to: [f64; 4], share: f64) -> [f64; 4] {
    let (from, to) = (Pose { quaternion: from, ..Pose::IDENTITY }, Pose { quaternion: to, ..Pose::IDENTITY });
    from.along(from.to(&to), share).quaternion
}

/// The seven numbers of way-points as poses, up to the first that is none: then its index in the list.
pub fn read_poses(given: &[Numbers; POINTS_MAX]) -> Result<[Pose; POINTS_MAX], usize> {
    let mut poses = [Pose::IDENTITY; POINTS_MAX];
    for (k, (pose, given)) in poses.iter_mut().zip(given).enumerate() {
        *pose = Pose::of(given).ok_or(k)?;
    }
    Ok(poses)
}
