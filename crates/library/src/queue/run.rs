// SPDX-License-Identifier: Apache-2.0
//! Motion along a path: a jerk-limited state of the path coordinate, forwards and backwards.
//!
//! On each piece, a motion is planned from the current state to the boundary ahead, where its acceleration is 0, and is followed until
//! something changes. From the speed at the boundary, the motion can still come to rest at the end of the path, so a plan can always be
//! followed once it has been made; a new plan replaces it only if it is feasible.
use super::law;
use super::span::Joints;
use super::{Piece, QueuedPath};
use crate::online::{Profile, State};
use crate::profile::Limits;

/// Position and motion on a path.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Number of the current piece.
    pub piece: i64,
    /// Path coordinate from the start of the piece, and its speed and acceleration.
    pub s: f64,
    pub velocity: f64,
    pub acceleration: f64,
    /// 1 forwards, -1 backwards.
    pub direction: f64,
    /// Permitted fraction of the speed in this direction.
    share: f64,
    /// Motion to the boundary ahead, with a coordinate that starts at the boundary behind, and the time since it was planned.
    leg: Profile,
    time_s: f64,
    /// Length of the piece for which the motion was planned.
    length: f64,
    /// True if something has changed since the motion was planned.
    is_stale: bool,
    /// Number of completed moves at which the motion comes to rest, from either direction.
    until: i64,
}

/// Number of completed moves that is never reached.
pub const ENDLESS: i64 = i64::MAX;

impl Default for Run {
    fn default() -> Run {
        let (direction, share, time_s, length) = (1.0, 0.0, 0.0, 0.0);
        Run {
            piece: 0,
            s: 0.0,
            velocity: 0.0,
            acceleration: 0.0,
            direction,
            share,
            leg: Profile::beginning(State::default()),
            time_s,
            length,
            is_stale: true,
            until: ENDLESS,
        }
    }
}

/// Set-points of one cycle, and their position on the path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    pub q: Joints,
    pub velocity: Joints,
    pub acceleration: Joints,
    /// Number of the move, and its completed fraction.
    pub number: i64,
    pub fraction: f64,
    /// Rate of change of that fraction, 1/s.
    pub place_rate: f64,
}

impl Sample {
    /// Returns the number of completed moves plus the completed fraction of the current one.
    pub fn place(&self) -> f64 {
        (self.number - 1) as f64 + self.fraction
    }
}

impl Run {
    /// Returns true if the path coordinate is at rest.
    pub fn is_at_rest(&self) -> bool {
        self.velocity == 0.0 && self.acceleration == 0.0
    }

    /// Returns true if the motion is at rest at the end of the path.
    pub fn is_at_end(&self, path: &QueuedPath) -> bool {
        path.end_piece == path.first_piece || (self.is_at_rest() && self.piece == path.end_piece - 1 && self.s == path.piece(self.piece).length)
    }

    /// Records that the path has changed.
    pub fn renew(&mut self) {
        self.is_stale = true;
    }

    /// Makes the motion come to rest at the boundary after this number of moves.
    pub fn rest_behind(&mut self, until: i64) {
        self.is_stale |= until != self.until;
        self.until = until;
    }

    /// Returns the state of the path coordinate on its piece.
    pub(super) fn state(&self) -> State {
        State { position: self.s, velocity: self.velocity, acceleration: self.acceleration }
    }

    /// Advances by `span_s` at a fraction `rate` of the planned speed, -1 to 1. A negative rate runs backwards along the path; with 0,
    /// the motion comes to rest on the path.
    pub fn advance(&mut self, path: &QueuedPath, span_s: f64, rate: f64) {
        if path.end_piece == path.first_piece {
            return;
        }
        if self.is_at_rest() && rate * self.direction < 0.0 {
            (self.direction, self.is_stale) = (-self.direction, true);
        }
        let share = (rate * self.direction).max(0.0);
        self.is_stale |= share != self.share;
        self.share = share;
        if self.is_stale {
            self.plan(path);
        }
        let mut left_s = span_s;
        loop {
            let rest_s = self.leg.duration_s() - self.time_s;
            if left_s < rest_s {
                self.time_s += left_s;
                return self.take(self.leg.at(self.time_s));
            }
            left_s -= rest_s.max(0.0);
            self.time_s += rest_s.max(0.0);
            self.take(self.leg.at(f64::INFINITY));
            if !self.enter_next(path) {
                return;
            }
            self.plan(path);
        }
    }

    /// Adopts a state of the leg.
    fn take(&mut self, state: State) {
        let forward = self.direction > 0.0;
        self.s = if forward { state.position } else { self.length - state.position };
        (self.velocity, self.acceleration) = (self.direction * state.velocity, self.direction * state.acceleration);
    }

    /// Continues with the next piece, if the motion has reached the boundary and there is a next piece.
    fn enter_next(&mut self, path: &QueuedPath) -> bool {
        let is_there = self.leg.end() == self.length && self.length == path.piece(self.piece).length;
        let next = self.piece + if self.direction > 0.0 { 1 } else { -1 };
        if !is_there || !(path.first_piece..path.end_piece).contains(&next) {
            return false;
        }
        let is_until = (path.piece(self.piece).number <= self.until) != (path.piece(next).number <= self.until);
        if self.velocity == 0.0 && (self.share == 0.0 || is_until) {
            return false;
        }
        self.piece = next;
        self.s = if self.direction > 0.0 { 0.0 } else { path.piece(next).length };
        true
    }

    /// Returns true if the motion can follow the path in its current form.
    pub(super) fn can_follow(&self, path: &QueuedPath) -> bool {
        let piece = path.piece(self.piece);
        let keeps = self.length == piece.length && self.leg.end() == piece.length && self.leg.end_velocity() <= piece.exit;
        keeps || self.direction < 0.0 || Profile::passing(self.state(), piece.length, 0.0, piece.exit, piece.limits()).is_some()
    }

    /// Returns the piece and the position at which the motion comes to rest if it brakes as soon as possible.
    pub(super) fn resting(mut self, path: &QueuedPath) -> (i64, f64) {
        self.advance(path, f64::INFINITY, 0.0);
        (self.piece, self.s)
    }

    /// Plans the motion to the boundary ahead, or keeps the current plan if a new one would be infeasible.
    fn plan(&mut self, path: &QueuedPath) {
        let piece = path.piece(self.piece);
        let forward = self.direction > 0.0;
        let position = if forward { self.s } else { piece.length - self.s };
        let state = State { position, velocity: self.direction * self.velocity, acceleration: self.direction * self.acceleration };
        if let Some(leg) = self.leg_from(state, piece, path) {
            (self.leg, self.time_s, self.length, self.is_stale) = (leg, 0.0, piece.length, false);
        }
    }

    fn leg_from(&self, state: State, piece: &Piece, path: &QueuedPath) -> Option<Profile> {
        let forward = self.direction > 0.0;
        let bound = if forward { piece.exit } else { piece.entry };
        let most = self.most_before_until(path, bound);
        if self.share == 0.0 || most.is_none() {
            return self.leg_to_rest(state, piece, bound);
        }
        let next = self.piece + if forward { 1 } else { -1 };
        let ahead = if (path.first_piece..path.end_piece).contains(&next) { path.piece(next).speed } else { f64::INFINITY };
        let limits = Limits { speed: self.share * piece.speed, ..piece.limits() };
        let leg = Profile::passing(state, piece.length, self.share * piece.speed.min(ahead), most.unwrap_or(bound), limits);
        // Too near to the boundary behind which it rests, it rests as soon as it can.
        if leg.is_none() && self.until != ENDLESS { self.leg_to_rest(state, piece, bound) } else { leg }
    }

    /// Returns the motion that comes to rest as soon as possible, on this piece or beyond it.
    fn leg_to_rest(&self, state: State, piece: &Piece, bound: f64) -> Option<Profile> {
        if self.is_at_rest() {
            return Some(Profile::beginning(state));
        }
        let stop = Profile::stop(state, piece.limits());
        if stop.end() <= piece.length { Some(stop) } else { Profile::passing(state, piece.length, 0.0, bound, piece.limits()) }
    }

    /// Returns the maximum speed at the boundary ahead, at most `bound`, from which the motion can still come to rest at `until`; `None`
    /// if the motion is already beyond that point.
    fn most_before_until(&self, path: &QueuedPath, bound: f64) -> Option<f64> {
        if self.until == ENDLESS {
            return Some(bound);
        }
        let forward = self.direction > 0.0;
        let is_before = |piece: i64| (path.piece(piece).number <= self.until) == forward;
        if !is_before(self.piece) {
            return None;
        }
        let ahead = if forward { 1 } else { -1 };
        let mut last = self.piece;
        while is_before(last) {
            if !(path.first_piece..path.end_piece).contains(&(last + ahead)) {
                return Some(bound);
            }
            last += ahead;
        }
        let mut speed: f64 = 0.0;
        last -= ahead;
        while last != self.piece {
            let (piece, before) = (path.piece(last), path.piece(last - ahead));
            let is_corner = if forward { before.stops } else { piece.stops } != 0;
            speed = if is_corner { 0.0 } else { law::reach(speed, piece.length, piece.limits()).min(piece.speed).min(before.speed) };
            last -= ahead;
        }
        Some(speed.min(bound))
    }

    /// Returns the set-points at the current position.
    pub fn sample(&self, path: &QueuedPath) -> Sample {
        if path.end_piece == path.first_piece {
            return Sample { q: path.end, ..Sample::default() };
        }
        let piece = path.piece(self.piece);
        let place = path.place(piece, self.s);
        let (v, a) = (self.velocity, self.acceleration);
        Sample {
            q: place.q,
            velocity: place.first.map(|first| first * v),
            acceleration: std::array::from_fn(|i| place.second[i] * v * v + place.first[i] * a),
            number: piece.number,
            // The end of a move is exact.
            fraction: if self.s >= piece.length { piece.to } else { piece.from + (piece.to - piece.from) * (self.s / piece.length) },
            place_rate: v * (piece.to - piece.from) / piece.length,
        }
    }
}
