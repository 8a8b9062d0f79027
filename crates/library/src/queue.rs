// SPDX-License-Identifier: Apache-2.0
//! Queue of moves of an arm: a path in space, and a motion along it.
//!
//! The path is geometry only: lines in joint space, courses of the tool, and blends of continuous curvature, all as polynomials that give
//! the joints as functions of a path coordinate ([`span`]). When a move is appended, its pieces receive scalar limits such that any state
//! of the path coordinate within them keeps every joint within its own limits ([`law`]), and a backward pass computes the speed at each
//! boundary from which the motion can still come to rest at the end of the path. The motion is a jerk-limited state of the path
//! coordinate ([`run`]). Overrides, pauses and steps back change this state and never the path, so the path is the same however it is
//! travelled.
//!
//! A change of speed ends at the boundary of two pieces, because the acceleration of the path coordinate is 0 there. Memory is fixed:
//! moves that do not fit wait until others have been completed.
mod abort;
mod append;
mod blend;
mod draft;
pub mod law;
pub mod marks;
pub mod run;
pub mod shape;
pub mod span;

use crate::kinematics::line::Obstacle;
use crate::kinematics::pose::Numbers;
use crate::profile::JOINTS_MAX;
pub use draft::Surroundings;
use marks::{MARKS_MAX, MARKS_OF_MOVE, Mark, MarkWish};
use opengpac::Type;
pub use run::{Run, Sample};
use span::{Joints, Span};

/// Maximum number of spans in a path, of pieces in a path, and of spans in one move.
pub const SPANS_MAX: usize = 256;
pub const PIECES_MAX: usize = 128;
pub const SPANS_OF_MOVE: usize = 32;
/// Maximum number of moves that wait to be appended to the path.
pub const WAITING_MAX: usize = 16;
/// Kind of a row that ends the queue: no further moves follow it.
pub const CLOSE: i32 = 3;
/// Mode of a move that replaces the moves before it.
pub const ABORTING: i32 = 2;
/// Number of moves whose ends are recorded.
pub const ENDS_MAX: usize = 32;

/// A request for a move.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct QueuedMove {
    /// 1, 2, …
    pub number: i64,
    /// 0: the joints move on a straight line in joint space; 1: the tool moves on a straight line; 2: the tool moves on an arc; 3: no
    /// move, and no further moves follow.
    pub kind: i32,
    /// 0: starts after the previous move has come to rest (buffered); 1: is blended with the previous move (blending); 2: replaces the
    /// rest of the path, which the motion leaves as soon as it can (aborting).
    pub mode: i32,
    /// Orientation of an arc: 0 via, 1 goal, 2 path.
    pub orientation: i32,
    /// Unit of `blend`: 0 fraction of the move, 1 rad (or m) of the joint that moves furthest, 2 m of the tool, 3 rad of its orientation.
    pub blend_unit: i32,
    /// Radius of the blend with the next move; 0: no blend.
    pub blend: f64,
    /// Angle of an arc, rad; 0: the arc ends at the goal.
    pub angle: f64,
    /// Time from rest to rest, s; 0: as fast as the limits allow.
    pub duration: f64,
    /// Goal positions of the joints, rad or m.
    pub joints: Joints,
    /// Goal of the tool, and a pose through which an arc passes.
    pub pose: Numbers,
    pub via: Numbers,
    /// Speed and acceleration of each joint.
    pub speed: Joints,
    pub acceleration: Joints,
    /// Speed, acceleration and jerk of the tool's position, m/s, m/s², m/s³, and of its orientation, rad/s, rad/s², rad/s³.
    pub linear: [f64; 3],
    pub angular: [f64; 3],
    /// Outputs that are switched during the move, in the order of their positions.
    pub marks: [MarkWish; MARKS_OF_MOVE],
}

/// Waiting moves, and the point at which a single step comes to rest.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct QueuedMoves {
    /// 1: the motion comes to rest after `until` moves, from either direction (a single step).
    pub stepping: i64,
    pub until: i64,
    /// The move with number k is in row k modulo 16.
    pub rows: [QueuedMove; WAITING_MAX],
}

/// Reason why a blend is smaller than requested, or absent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shrunk {
    /// The blend is as requested.
    No = 0,
    /// The blend is limited to half of its move.
    HalfOfMove = 1,
    /// The blend is limited to half of the next move.
    HalfOfNext = 2,
    /// The arm was already too near to the corner when the next move arrived.
    Late = 3,
    /// A larger blend would have taken longer than a stop.
    Slower = 4,
    /// The next move is not blended, or there is none.
    Stopped = 5,
    /// A larger blend would have left the range of a joint.
    Range = 6,
    /// The move, or the rest of it, was replaced by a later move.
    Aborted = 7,
}

/// Record of the end of a move.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct MoveEnd {
    /// Number of the move; 0: none yet.
    pub number: i64,
    /// Fraction of the requested radius that was blended, 0 to 1.
    pub kept: f64,
    /// Reason, as the number of a [`Shrunk`].
    pub reason: i64,
}

/// Progress of a queue of moves. It has no padding, because padding bytes would differ between a run and its replay.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct QueueProgress {
    /// Number of the move that contains the set-point; the first half of a blend belongs to the earlier move, the second half to the
    /// later one.
    pub number: i64,
    /// Completed fraction of that move, 0 to 1.
    pub fraction: f64,
    /// Number of the last move that was taken from the waiting moves.
    pub taken: i64,
    /// Number of a refused move, or 0; the reason and its value are those of [`Refusal::numbers`].
    pub refused: i64,
    pub reason: i64,
    pub value: f64,
    /// Longest time lost in a single gap, s.
    pub lost: f64,
    /// 1: the set-point is at rest.
    pub resting: i64,
    /// Number of completed moves at which the motion comes to rest, as read from the input.
    pub until: i64,
    /// Bit masks of the outputs that have been switched, and of the outputs that are on; output i is bit i - 1.
    pub switched: i64,
    pub on: i64,
    /// Ends of the most recent moves; the end of move k is in row k modulo 32.
    pub ends: [MoveEnd; ENDS_MAX],
}

/// Reason why a move cannot be appended. In that case, nothing has changed, except that an aborting move may already have ended the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// There is not enough space until other moves have been completed, or an aborting move cannot end the path now: the motion runs
    /// backwards, or no suitable end lies ahead of it.
    Full,
    /// The goal is out of reach; the value is the distance, m.
    Unreachable(f64),
    /// The move leaves the range of this joint.
    Limit(i32),
    /// The arm comes so close to a singularity that only this fraction of the speed is possible.
    Singular(f64),
    /// The three poses do not define an arc; the value is the number of the reason.
    NoArc(i32),
    /// The move cannot be completed within its duration; the value is the minimum duration, s.
    TooShort(f64),
    /// A value of the move is not finite, or a limit is not above 0.
    Bad,
}

impl Refusal {
    /// Returns the number of the reason and its value: 1 unreachable (m), 2 limit (joint), 3 singular (fraction of the speed), 4 no arc
    /// (the reason, as in `arc_planner`), 5 duration too short (the minimum duration, s), 0 any other reason.
    pub fn numbers(&self) -> (i64, f64) {
        match self {
            Refusal::Unreachable(distance) => (1, *distance),
            Refusal::Limit(joint) => (2, f64::from(*joint)),
            Refusal::Singular(part) => (3, *part),
            Refusal::NoArc(reason) => (4, f64::from(*reason)),
            Refusal::TooShort(least_s) => (5, *least_s),
            Refusal::Full | Refusal::Bad => (0, 0.0),
        }
    }
}

impl From<Obstacle> for Refusal {
    fn from(obstacle: Obstacle) -> Refusal {
        match obstacle {
            Obstacle::Unreachable(distance) => Refusal::Unreachable(distance),
            Obstacle::Limit(joint) => Refusal::Limit(joint as i32),
            Obstacle::Singular(part) => Refusal::Singular(part),
        }
    }
}

/// A piece of the path with its own limits: a move without its blends, or half of a blend.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Piece {
    /// Number of the move to which it belongs.
    pub number: i64,
    /// Number of its first span, and the number of its spans.
    pub first: i64,
    pub spans: i64,
    /// Length in the path coordinate.
    pub length: f64,
    /// Maximum speed, acceleration and jerk of the path coordinate.
    pub speed: f64,
    pub acceleration: f64,
    pub jerk: f64,
    /// Maximum speed at its end when the motion runs forwards, and at its start when it runs backwards.
    pub exit: f64,
    pub entry: f64,
    /// 1: the motion comes to rest at its end, where the path has a corner.
    pub stops: i64,
    /// Fractions of the move at the start and at the end of the piece.
    pub from: f64,
    pub to: f64,
    /// Maximum acceleration of the tool, m/s² (0: no limit), and of each joint, for a blend that leaves the piece.
    pub linear: f64,
    pub joints: Joints,
}

/// The last move of the path, with which the next one may be blended.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Tip {
    /// Number of the move; 0: the path is empty.
    pub number: i64,
    pub kind: i64,
    /// Length of the whole move in the path coordinate, and of its requested blend.
    pub length: f64,
    pub blend: f64,
    /// Length in the path coordinate of 1 m (or rad) of a course.
    pub scale: f64,
    /// Requested maximum speed of the path coordinate.
    pub speed: f64,
    /// Maximum acceleration of the tool, m/s²; 0: no limit.
    pub linear: f64,
    /// Maximum acceleration of each joint.
    pub acceleration: Joints,
}

/// The path: ring buffers of spans and pieces, addressed by numbers that only increase.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct QueuedPath {
    /// Number of joints.
    pub joints: i64,
    pub spans: [Span; SPANS_MAX],
    pub pieces: [Piece; PIECES_MAX],
    /// Spans of a move that has not been appended yet.
    pub draft: [Span; SPANS_OF_MOVE],
    pub first_span: i64,
    pub end_span: i64,
    pub first_piece: i64,
    pub end_piece: i64,
    pub tip: Tip,
    /// Joint positions at the end of the path.
    pub end: Joints,
    /// Marks at which outputs are switched, in a ring buffer, and the state of the outputs before the first of them.
    pub marks: [Mark; MARKS_MAX],
    pub first_mark: i64,
    pub end_mark: i64,
    pub switched: i64,
    pub on: i64,
    /// Ends of the most recent moves; the end of move k is at index k modulo their number.
    pub ends: [MoveEnd; ENDS_MAX],
}

impl QueuedPath {
    /// Clears the path; it then begins with `n` joints at `q`.
    pub fn clear(&mut self, q: &Joints, n: usize) {
        self.joints = n as i64;
        (self.first_span, self.end_span, self.first_piece, self.end_piece) = (0, 0, 0, 0);
        (self.first_mark, self.end_mark, self.switched, self.on) = (0, 0, 0, 0);
        (self.tip, self.end) = (<Tip as Type>::zero(), *q);
        self.ends = [<MoveEnd as Type>::zero(); ENDS_MAX];
    }

    /// Returns a piece by its number.
    pub fn piece(&self, number: i64) -> &Piece {
        &self.pieces[number.rem_euclid(PIECES_MAX as i64) as usize]
    }

    fn piece_mut(&mut self, number: i64) -> &mut Piece {
        &mut self.pieces[number.rem_euclid(PIECES_MAX as i64) as usize]
    }

    /// Returns a span by its number.
    pub fn span(&self, number: i64) -> &Span {
        &self.spans[number.rem_euclid(SPANS_MAX as i64) as usize]
    }

    fn span_mut(&mut self, number: i64) -> &mut Span {
        &mut self.spans[number.rem_euclid(SPANS_MAX as i64) as usize]
    }

    /// Returns the place at `s` from the start of a piece.
    pub fn place(&self, piece: &Piece, s: f64) -> span::Place {
        let (number, rest) = self.span_at(piece, s);
        self.span(number).at(rest, self.joints as usize)
    }

    /// Returns the span of a piece at `s` from its start, and the distance from the start of the span.
    fn span_at(&self, piece: &Piece, s: f64) -> (i64, f64) {
        let mut rest = s;
        let last = piece.first + piece.spans - 1;
        for number in piece.first..last {
            let length = self.span(number).length;
            if rest < length {
                return (number, rest);
            }
            rest -= length;
        }
        // The end of the piece is exactly that of its last span.
        (last, if s >= piece.length { self.span(last).length } else { rest })
    }

    /// Returns the record of the end of a move.
    pub fn end_of(&mut self, number: i64) -> &mut MoveEnd {
        &mut self.ends[number.rem_euclid(ENDS_MAX as i64) as usize]
    }
}

const _: () = assert!(JOINTS_MAX == crate::kinematics::JOINTS_MAX);
