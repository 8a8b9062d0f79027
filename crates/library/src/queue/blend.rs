// SPDX-License-Identifier: Apache-2.0
//! Blends: curves of continuous curvature in joint space, from the end of one move to the start of the next.
//!
//! A blend leaves a move at a distance before its goal, and joins the next move at the same distance after that point, in the path
//! coordinate. It is the path with the corner, except that the step of the first derivative is spread over the blend: the second
//! derivative rises linearly, is constant, and falls linearly. The length of the rise is chosen so that the jerk and acceleration limits
//! of the joints allow the highest speed. A blend is reduced if it would take more than half of a move or if the arm is too near, and it
//! is omitted if a stop would be faster; the reason is reported.
use super::draft::{Draft, Surroundings};
use super::law::{self, OF_BLENDS};
use super::span::{Joints, Place, Span};
use super::{Piece, QueuedMove, QueuedPath, Run, Shrunk};
use crate::online::Profile;
use crate::profile::{JOINTS_MAX, Limits};
use opengpac::Type;

/// Fraction of a move that a blend may take. It is slightly less than half, so that something remains between two blends.
const HALF: f64 = 0.5 - 1e-6;
/// Number of times that a blend is halved before the path stops instead.
const HALVINGS: u32 = 6;
/// Fractions of a blend over which its second derivative rises, and over which it falls; the one that gives the fastest blend is used.
const RISES: [f64; 5] = [0.4, 0.3, 0.2, 0.12, 0.06];
/// Number of spans of a blend.
pub(super) const SPANS_OF_BLEND: i64 = 4;

/// Corner between two moves.
pub(super) struct Corner {
    /// Length that the blend takes from each of the two moves; 0: the path stops at the corner.
    pub reach: f64,
    pub reason: Shrunk,
    pub halves: [[Span; 2]; 2],
    pub limits: [Limits; 2],
}

impl Corner {
    /// Returns a corner at which the path stops.
    pub fn stop(reason: Shrunk) -> Corner {
        let none = Limits { speed: 0.0, acceleration: 0.0, jerk: 0.0 };
        Corner { reach: 0.0, reason, halves: [[<Span as Type>::zero(); 2]; 2], limits: [none; 2] }
    }

    /// Returns the speed at which the corner is passed.
    fn speed(&self) -> f64 {
        self.limits[0].speed.min(self.limits[1].speed)
    }
}

impl QueuedPath {
    /// Returns the corner between the last move and the draft.
    pub(super) fn corner(&self, asked: &QueuedMove, draft: &Draft, around: &Surroundings, run: &Run) -> Corner {
        let last = *self.piece(self.end_piece - 1);
        let (mut reach, mut reason) = (self.tip.blend, Shrunk::No);
        for (most, half) in [(self.tip.length, Shrunk::HalfOfMove), (draft.length, Shrunk::HalfOfNext)] {
            if reach > HALF * most {
                // Exactly half is what was requested.
                reason = if reach > 0.5 * most * (1.0 + 1e-9) { half } else { reason };
                reach = HALF * most;
            }
        }
        for _ in 0..=HALVINGS {
            let corner = self.fastest(reach, reason, asked, draft, around);
            if leaves_range(&corner, around) {
                reason = Shrunk::Range;
            } else if !self.can_turn(&corner, &last, draft, run) {
                reason = Shrunk::Late;
            } else if is_slower(&corner, &last, draft) {
                // A smaller one is passed even more slowly.
                return Corner::stop(Shrunk::Slower);
            } else {
                return corner;
            }
            reach /= 2.0;
        }
        Corner::stop(reason)
    }

    /// Returns the fastest blend of this size.
    fn fastest(&self, reach: f64, reason: Shrunk, asked: &QueuedMove, draft: &Draft, around: &Surroundings) -> Corner {
        let mut best = self.blended(reach, reason, RISES[0], asked, draft, around);
        for rise in &RISES[1..] {
            let other = self.blended(reach, reason, *rise, asked, draft, around);
            if other.speed() > best.speed() {
                best = other;
            }
        }
        best
    }

    /// Returns a blend of this size whose second derivative rises over the fraction `rise` of it.
    fn blended(&self, reach: f64, reason: Shrunk, rise: f64, asked: &QueuedMove, draft: &Draft, around: &Surroundings) -> Corner {
        let last = self.piece(self.end_piece - 1);
        let (before, after) = (|s: f64| self.place(last, last.length - s), |s: f64| self.place_of_draft(draft, s));
        let (from, to, ends, begins) = (before(reach), after(reach), before(0.0), after(0.0));
        let change: Joints = std::array::from_fn(|i| begins.first[i] - ends.first[i]);
        // The kink spread over the blend: its second derivative on the plateau, and place and slope where it begins and in the middle.
        let whole = 2.0 * reach;
        let (step, peak) = (rise * whole, 1.0 / (whole * (1.0 - rise)));
        let flat = reach - step;
        let (low, slope) = (peak * step * step / 6.0, peak * step / 2.0);
        let middle = Place { second: std::array::from_fn(|i| ends.second[i].midpoint(begins.second[i])), ..ends };
        let middle = added(&middle, &change, [low + slope * flat + peak * flat * flat / 2.0, 0.5, peak]);
        let (rising, falling) = (added(&before(flat), &change, [low, slope, peak]), added(&after(flat), &change, [low, -slope, peak]));
        let halves = [
            [Span::between(&from, &rising, step), Span::between(&rising, &middle, flat)],
            [Span::between(&middle, &falling, flat), Span::between(&falling, &to, step)],
        ];
        let joints: [Limits; JOINTS_MAX] = std::array::from_fn(|i| match around.joints.get(i) {
            Some(joint) => Limits { acceleration: self.tip.acceleration[i].min(draft.acceleration[i]), ..*joint },
            None => Limits { speed: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY },
        });
        let mut most = Limits { speed: self.tip.speed.max(draft.speed), acceleration: f64::INFINITY, jerk: f64::INFINITY };
        if self.tip.linear > 0.0 || asked.kind != 0 {
            // The tool turns within its own acceleration, too.
            let limit =
                [self.tip.linear, if asked.kind == 0 { 0.0 } else { asked.linear[1] }].into_iter().filter(|limit| *limit > 0.0).fold(f64::INFINITY, f64::min);
            most.speed = most.speed.min((OF_BLENDS.acceleration * limit / (peak * change_of_tool(around, &ends.q, &change))).sqrt());
        }
        let n = around.joints.len();
        let limits = halves.map(|half| {
            let mut bounds = half[0].bounds();
            bounds.include(&half[1].bounds());
            law::limits(&bounds, &joints[..n], most, OF_BLENDS)
        });
        Corner { reach, reason, halves, limits }
    }

    fn place_of_draft(&self, draft: &Draft, s: f64) -> Place {
        let each = draft.length / draft.count as f64;
        let k = ((s / each) as usize).min(draft.count - 1);
        self.draft[k].at(s - k as f64 * each, self.joints as usize)
    }

    /// Returns true if the motion can still take the blend: it has not reached the blend yet, and can slow down sufficiently before it.
    fn can_turn(&self, corner: &Corner, last: &Piece, draft: &Draft, run: &Run) -> bool {
        let number = self.end_piece - 1;
        let way = last.length - corner.reach;
        if run.piece == number && run.s >= way {
            return false;
        }
        if run.direction < 0.0 {
            return true;
        }
        let [first, second] = corner.limits;
        let leaving = law::reach(0.0, draft.length - corner.reach, draft.limits).min(draft.limits.speed).min(second.speed);
        let middle = law::reach(leaving, corner.reach, second).min(second.speed).min(first.speed);
        let mut exit = law::reach(middle, corner.reach, first).min(first.speed).min(last.speed);
        let mut length = way;
        // A shorter move with a blend may have to begin more slowly than the whole one with a stop.
        for ahead in (run.piece + 1..=number).rev() {
            let (piece, before) = (self.piece(ahead), self.piece(ahead - 1));
            let on_it = if ahead == number { way } else { piece.length };
            exit = if before.stops != 0 { 0.0 } else { law::reach(exit, on_it, piece.limits()).min(piece.speed).min(before.speed) };
            length = before.length;
        }
        Profile::passing(run.state(), length, exit, exit, self.piece(run.piece).limits()).is_some()
    }
}

/// Adds multiples of `change`, a change of the first derivative, to the position and to the first and second derivatives of a place.
fn added(place: &Place, change: &Joints, [position, first, second]: [f64; 3]) -> Place {
    Place {
        q: std::array::from_fn(|i| place.q[i] + position * change[i]),
        first: std::array::from_fn(|i| place.first[i] + first * change[i]),
        second: std::array::from_fn(|i| place.second[i] + second * change[i]),
    }
}

/// Returns true if a joint leaves its range in the blend.
fn leaves_range(corner: &Corner, around: &Surroundings) -> bool {
    let [before, after] = &corner.halves;
    (0..around.joints.len()).any(|i| {
        // Joints that are outside their range already may stay there.
        let (low, high) = (before[0].points[i][0].min(after[1].points[i][5]), before[0].points[i][0].max(after[1].points[i][5]));
        let (least, most) = (around.ranges.min[i].min(low), around.ranges.max[i].max(high));
        corner.halves.iter().flatten().any(|half| half.range(i).0 < least || half.range(i).1 > most)
    })
}

/// Returns true if the blend takes longer than a stop at the corner, if the motion is at rest at the other ends of both moves.
fn is_slower(corner: &Corner, last: &Piece, draft: &Draft) -> bool {
    let (before, after) = (last.length - corner.reach, draft.length - corner.reach);
    let [first, second] = corner.limits;
    let reachable = law::reach(0.0, before, last.limits()).min(law::reach(0.0, after, draft.limits));
    let speed = first.speed.min(second.speed).min(last.speed).min(draft.limits.speed).min(reachable);
    let blended = law::time_s(before, 0.0, speed, last.limits()) + 2.0 * corner.reach / speed + law::time_s(after, speed, 0.0, draft.limits);
    blended > law::time_s(last.length, 0.0, 0.0, last.limits()) + law::time_s(draft.length, 0.0, 0.0, draft.limits)
}

/// Returns the magnitude of the change of the tool's velocity at a corner, per unit of the path coordinate.
fn change_of_tool(around: &Surroundings, q: &Joints, change: &Joints) -> f64 {
    let rows = around.arm.jacobian(&around.arm.posture(&q[..around.joints.len()]));
    let velocity: [f64; 3] = std::array::from_fn(|k| rows.iter().zip(change).map(|(row, rate): (&[f64; 6], &f64)| row[k] * rate).sum());
    crate::kinematics::pose::length(velocity)
}
