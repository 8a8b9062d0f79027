// SPDX-License-Identifier: Apache-2.0
//! Appends a move to a path: its shape, its length in the path coordinate, its limits, and the speeds at all boundaries.
//!
//! The path coordinate is scaled so that the joints' derivatives with respect to it have equal magnitudes on both sides of a corner. The
//! speed therefore has no step where a blend begins or ends.
use super::blend::{Corner, SPANS_OF_BLEND};
use super::draft::{Draft, Surroundings};
use super::law::{self, OF_MOVES};
use super::marks::{Mark, MarkWish, OUTPUTS_MAX};
use super::shape::{CourseWish, Shape};
use super::span::Joints;
use super::{ABORTING, MoveEnd, PIECES_MAX, Piece, QueuedMove, QueuedPath, Refusal, Run, SPANS_MAX, Shrunk, Tip};
use crate::kinematics::course::{self, Course, Orientation};
use crate::kinematics::pose::{Pose, length};
use crate::profile::{JOINTS_MAX, Limits};
use opengpac::Type;

/// Minimum acceptable fraction of the requested speed of the tool.
const SLOWEST: f64 = 0.02;
/// Displacement of the joints (rad or m) or of the tool below which there is no motion.
const NOTHING: f64 = 1e-9;
/// Displacement that is equivalent to a rotation of 1 rad, for a course that only rotates, m.
const LEVER: f64 = 0.25;
/// Number of pieces that a move adds: its body and the two halves of a blend.
const PIECES_OF_MOVE: i64 = 3;
const UNBOUNDED: Limits = Limits { speed: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };

impl QueuedPath {
    /// Appends a move to the end of the path; `run` is the current state of the motion on it.
    ///
    /// A refused move changes nothing, with one exception: an aborting move first ends the path, so if the move itself is then refused, the
    /// motion comes to rest at that end.
    pub fn append(&mut self, asked: &QueuedMove, around: &Surroundings, run: &Run) -> Result<(), Refusal> {
        if asked.mode == ABORTING {
            self.abort(asked, around, run)?;
        }
        let is_blended = asked.mode != 0 && self.tip.number != 0 && self.tip.blend > 0.0;
        let Some(draft) = self.draft(asked, around, is_blended)? else {
            self.make_room_for_marks(run.sample(self).place())?;
            self.mark(asked, |_, _| 0.0);
            *self.end_of(asked.number) = MoveEnd { number: asked.number, kept: 0.0, reason: Shrunk::No as i64 };
            return Ok(());
        };
        self.make_room_for_marks(run.sample(self).place())?;
        self.make_room(draft.count as i64 + SPANS_OF_BLEND, run)?;
        self.mark(asked, |before, unit| draft.reach(before, unit) / draft.length);
        let corner = if is_blended { self.corner(asked, &draft, around, run) } else { Corner::stop(Shrunk::Stopped) };
        self.close_tip(&corner);
        let from_piece = (self.end_piece - 1).max(self.first_piece);
        let cut = self.add_corner(&corner, &draft, asked);
        self.add_body(asked, &draft, cut);
        self.update_exits(run.piece);
        self.update_entries(from_piece);
        Ok(())
    }

    /// Creates the shape of a move, and its limits; `None` if the move has no displacement.
    pub(super) fn draft(&mut self, asked: &QueuedMove, around: &Surroundings, is_blended: bool) -> Result<Option<Draft>, Refusal> {
        let is_mark = |mark: &MarkWish| (0..=OUTPUTS_MAX as i32).contains(&mark.output) && mark.before >= 0.0 && are_finite(&[mark.before, mark.ahead]);
        if !(asked.blend.is_finite() && asked.blend >= 0.0 && asked.duration.is_finite() && asked.duration >= 0.0 && asked.marks.iter().all(is_mark)) {
            return Err(Refusal::Bad);
        }
        let norm = if is_blended { self.norm_at_end(around) } else { 1.0 };
        if asked.kind == 0 { self.draft_of_joints(asked, around, norm) } else { self.draft_of_tool(asked, around, norm, is_blended) }
    }

    fn draft_of_joints(&mut self, asked: &QueuedMove, around: &Surroundings, norm: f64) -> Result<Option<Draft>, Refusal> {
        let n = around.joints.len();
        if !(are_finite(&asked.joints[..n]) && are_positive(&asked.speed[..n]) && are_positive(&asked.acceleration[..n])) {
            return Err(Refusal::Bad);
        }
        let outside = |i: &usize| !(around.ranges.min[*i]..=around.ranges.max[*i]).contains(&asked.joints[*i]);
        if let Some(joint) = (0..n).find(outside) {
            return Err(Refusal::Limit(joint as i32));
        }
        let mut goal = self.end;
        goal[..n].copy_from_slice(&asked.joints[..n]);
        let way: Joints = std::array::from_fn(|i| goal[i] - self.end[i]);
        if way.iter().all(|way| way.abs() < NOTHING) {
            return Ok(None);
        }
        let mut shape = Shape { spans: &mut self.draft, count: 0 };
        shape.line(&self.end, &goal);
        let length = weighted(&way, around.joints) / norm;
        let joints: [Limits; JOINTS_MAX] = std::array::from_fn(|i| match around.joints.get(i) {
            Some(joint) => Limits { speed: asked.speed[i].min(joint.speed), acceleration: asked.acceleration[i].min(joint.acceleration), ..*joint },
            None => UNBOUNDED,
        });
        let bounds = shape.bounds().scaled(length);
        shape.stretch(length);
        let limits = law::in_duration(length, law::limits(&bounds, &joints[..n], UNBOUNDED, OF_MOVES), asked.duration).map_err(Refusal::TooShort)?;
        let acceleration = std::array::from_fn(|i| joints[i].acceleration);
        Ok(Some(Draft { count: 1, bounds, length, scale: 0.0, limits, speed: limits.speed, acceleration, turn: 0.0 }))
    }

    fn draft_of_tool(&mut self, asked: &QueuedMove, around: &Surroundings, norm: f64, is_blended: bool) -> Result<Option<Draft>, Refusal> {
        let n = around.joints.len();
        if !(are_positive(&asked.linear) && are_positive(&asked.angular)) {
            return Err(Refusal::Bad);
        }
        let tool = around.arm.posture(&self.end[..n]).tool;
        let (goal, course) = course_of(asked, &tool)?;
        let (way, angle) = (length(course.along), length(course.turn) + 2.0 * length(course.bend));
        if way < NOTHING && angle < NOTHING {
            return Ok(None);
        }
        let mut shape = Shape { spans: &mut self.draft, count: 0 };
        shape.course(around.arm, &CourseWish { from: &self.end, course: &course, goal, joints: around.joints, ranges: around.ranges })?;
        let count = shape.count;
        let natural = if way > NOTHING { way } else { LEVER * angle };
        let slope = shape.spans[0].at(0.0, n).first;
        let length = if is_blended && self.tip.kind != 0 { natural * self.tip.scale } else { weighted(&slope, around.joints) / norm };
        let bounds = shape.bounds().scaled(length);
        shape.stretch(length);
        let (linear, angular) = (course.along_it(of(&asked.linear)), of(&asked.angular));
        let most = smaller(&divided(&linear, way / length), &divided(&angular, angle / length));
        let limits = law::fastest(length, &bounds, around.joints, most);
        if limits.speed < SLOWEST * most.speed {
            return Err(Refusal::Singular(limits.speed / most.speed));
        }
        let limits = law::in_duration(length, limits, asked.duration).map_err(Refusal::TooShort)?;
        let acceleration = std::array::from_fn(|i| around.joints.get(i).map_or(f64::INFINITY, |joint| joint.acceleration));
        Ok(Some(Draft {
            count,
            bounds,
            length,
            scale: length / natural,
            limits,
            speed: if asked.duration > 0.0 { limits.speed } else { most.speed },
            acceleration,
            turn: angle,
        }))
    }

    /// Adds the marks of a move; `part` converts a distance in a unit to a fraction of the move.
    fn mark(&mut self, asked: &QueuedMove, part: impl Fn(f64, i64) -> f64) {
        let wishes = asked.marks.iter().filter(|wish| wish.output != 0);
        self.add_marks(wishes.map(|wish| Mark {
            place: asked.number as f64 - part(wish.before, wish.unit).clamp(0.0, 1.0),
            output: wish.output,
            on: wish.on,
            ahead: wish.ahead,
        }));
    }

    /// Returns the magnitude of the joints' derivatives at the end of the path.
    fn norm_at_end(&self, around: &Surroundings) -> f64 {
        let last = self.piece(self.end_piece - 1);
        weighted(&self.place(last, last.length).first, around.joints)
    }

    /// Drops completed pieces until there is space for a move with this number of spans.
    fn make_room(&mut self, spans: i64, run: &Run) -> Result<(), Refusal> {
        let first = self.first_piece;
        let is_full = |path: &QueuedPath| {
            path.end_piece - path.first_piece > PIECES_MAX as i64 - PIECES_OF_MOVE || path.end_span - path.first_span > SPANS_MAX as i64 - spans
        };
        while is_full(self) {
            // On the way back the pieces behind are those ahead.
            if self.first_piece >= run.piece || run.direction < 0.0 {
                return Err(Refusal::Full);
            }
            self.first_piece += 1;
            self.first_span = self.piece(self.first_piece).first;
        }
        if self.first_piece != first {
            self.update_entries(self.first_piece);
        }
        Ok(())
    }

    /// Records the end of the last move.
    fn close_tip(&mut self, corner: &Corner) {
        let Tip { number, blend, .. } = self.tip;
        if number == 0 || self.end_of(number).reason == Shrunk::Aborted as i64 {
            return;
        }
        let (kept, reason) = if blend > 0.0 { (corner.reach / blend, corner.reason) } else { (0.0, Shrunk::No) };
        let kept = if reason == Shrunk::No && blend > 0.0 { 1.0 } else { kept };
        *self.end_of(number) = MoveEnd { number, kept, reason: reason as i64 };
    }

    /// Shortens the last move and adds the blend, or marks a stop. Returns the length that the blend takes from the next move.
    fn add_corner(&mut self, corner: &Corner, draft: &Draft, asked: &QueuedMove) -> f64 {
        if self.end_piece == self.first_piece {
            return 0.0;
        }
        let number = self.end_piece - 1;
        if corner.reach == 0.0 {
            self.piece_mut(number).stops = 1;
            return 0.0;
        }
        let mut piece = *self.piece(number);
        let rest = piece.length - corner.reach;
        let (last, s) = self.span_at(&piece, rest);
        let [kept, _] = self.span(last).divided(s);
        *self.span_mut(last) = kept;
        self.end_span = last + 1;
        (piece.length, piece.spans) = (rest, last + 1 - piece.first);
        let (to, all) = (piece.to, piece.to - piece.from);
        piece.to -= all * corner.reach / (rest + corner.reach);
        *self.piece_mut(number) = piece;
        let shares = [(self.tip.number, piece.to, to), (asked.number, 0.0, corner.reach / draft.length)];
        for ((half, limits), (number, from, to)) in corner.halves.iter().zip(&corner.limits).zip(shares) {
            let first = self.end_span;
            for span in half {
                let end = self.end_span;
                *self.span_mut(end) = *span;
                self.end_span += 1;
            }
            let (linear, joints) = (self.tip.linear, self.tip.acceleration);
            self.add_piece(Piece { number, first, spans: half.len() as i64, length: corner.reach, from, to, linear, joints, ..with(limits) });
        }
        corner.reach
    }

    /// Adds the draft, except for the length `cut` at its start.
    fn add_body(&mut self, asked: &QueuedMove, draft: &Draft, cut: f64) {
        let first = self.end_span;
        let mut before = 0.0;
        for k in 0..draft.count {
            let span = self.draft[k];
            let start = cut - before;
            before += span.length;
            if start < span.length {
                let end = self.end_span;
                *self.span_mut(end) = if start > 0.0 { span.divided(start)[1] } else { span };
                self.end_span += 1;
            }
        }
        let (from, length) = (cut / draft.length, draft.length - cut);
        let (linear, joints) = (if asked.kind == 0 { 0.0 } else { asked.linear[1] }, draft.acceleration);
        self.add_piece(Piece { number: asked.number, first, spans: self.end_span - first, length, from, to: 1.0, linear, joints, ..with(&draft.limits) });
        let last = *self.span(self.end_span - 1);
        self.end = std::array::from_fn(|i| last.points[i][5]);
        let blend = draft.reach(asked.blend, i64::from(asked.blend_unit));
        self.tip = Tip {
            number: asked.number,
            kind: i64::from(asked.kind),
            length: draft.length,
            blend,
            scale: draft.scale,
            speed: draft.speed,
            linear,
            acceleration: joints,
        };
        *self.end_of(asked.number) = MoveEnd { number: asked.number, kept: 0.0, reason: if blend > 0.0 { Shrunk::Stopped } else { Shrunk::No } as i64 };
    }

    fn add_piece(&mut self, piece: Piece) {
        let number = self.end_piece;
        *self.piece_mut(number) = piece;
        self.end_piece += 1;
    }

    /// Computes the speeds at the ends of the pieces, from `first` onwards, from which the motion can still come to rest at the end of
    /// the path.
    pub(super) fn update_exits(&mut self, first: i64) {
        let mut exit = 0.0;
        for number in (first.max(self.first_piece)..self.end_piece).rev() {
            self.piece_mut(number).exit = exit;
            let piece = *self.piece(number);
            if number > self.first_piece {
                let before = self.piece(number - 1);
                exit = if before.stops != 0 { 0.0 } else { law::reach(exit, piece.length, piece.limits()).min(piece.speed).min(before.speed) };
            }
        }
    }

    /// Computes the speeds at the starts of the pieces, from `first` onwards, from which a motion that runs backwards can still come to
    /// rest at the start of the path.
    fn update_entries(&mut self, first: i64) {
        for number in first..self.end_piece {
            let entry = if number == self.first_piece {
                0.0
            } else {
                let before = *self.piece(number - 1);
                if before.stops != 0 { 0.0 } else { law::reach(before.entry, before.length, before.limits()).min(before.speed).min(self.piece(number).speed) }
            };
            self.piece_mut(number).entry = entry;
        }
    }
}

impl Piece {
    /// Returns the limits of the path coordinate.
    pub fn limits(&self) -> Limits {
        Limits { speed: self.speed, acceleration: self.acceleration, jerk: self.jerk }
    }
}

/// Returns a piece with these limits.
fn with(limits: &Limits) -> Piece {
    Piece { speed: limits.speed, acceleration: limits.acceleration, jerk: limits.jerk, ..<Piece as Type>::zero() }
}

/// Returns the goal and the course of a move of the tool.
fn course_of(asked: &QueuedMove, tool: &Pose) -> Result<(Pose, Course), Refusal> {
    let goal = Pose::of(&asked.pose).ok_or(Refusal::Bad)?;
    if asked.kind == 1 {
        return Ok((goal, Course::straight(tool, &goal)));
    }
    let via = Pose::of(&asked.via).ok_or(Refusal::Bad)?;
    let orientation = Orientation::of(asked.orientation).ok_or(Refusal::Bad)?;
    let arc = course::Arc { via, goal, angle: (asked.angle > 0.0).then_some(asked.angle), orientation };
    Course::arc(tool, &arc).map(|course| (goal, course)).map_err(|reason| Refusal::NoArc(reason as i32))
}

fn are_finite(values: &[f64]) -> bool {
    values.iter().all(|x| x.is_finite())
}

fn are_positive(values: &[f64]) -> bool {
    values.iter().all(|x| x.is_finite() && *x > 0.0)
}

/// Returns the magnitude of a displacement of the joints, each in units of its maximum speed.
fn weighted(way: &Joints, joints: &[Limits]) -> f64 {
    way.iter().zip(joints).map(|(way, joint)| (way / joint.speed) * (way / joint.speed)).sum::<f64>().sqrt()
}

fn of([speed, acceleration, jerk]: &[f64; 3]) -> Limits {
    Limits { speed: *speed, acceleration: *acceleration, jerk: *jerk }
}

fn divided(limits: &Limits, by: f64) -> Limits {
    Limits { speed: limits.speed / by, acceleration: limits.acceleration / by, jerk: limits.jerk / by }
}

fn smaller(a: &Limits, b: &Limits) -> Limits {
    Limits { speed: a.speed.min(b.speed), acceleration: a.acceleration.min(b.acceleration), jerk: a.jerk.min(b.jerk) }
}
