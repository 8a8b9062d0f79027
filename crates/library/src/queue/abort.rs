// SPDX-License-Identifier: Apache-2.0
//! A move that replaces the moves before it: the path ends near the point where the motion can come to rest, and blends into the move if
//! possible.
use super::draft::Surroundings;
use super::run::Run;
use super::span::Span;
use super::{MoveEnd, Piece, QueuedMove, QueuedPath, Refusal, Shrunk, Tip};

/// Fractions of a piece by which its new end lies beyond the point where the motion comes to rest; the smallest one that the motion can
/// follow is used.
const MARGINS: [f64; 5] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5];
/// Fraction of the distance to the end of the path that a blend may take.
const REACH: f64 = 0.95;
/// Ends of the path that are tried for a blend, as multiples of the stopping distance. If none of them allows a blend, the motion comes
/// to rest at the last one.
const ENDS: [f64; 3] = [2.5, 1.6, 1.0];

/// State of a path before a cut, kept to undo the cut.
struct Before {
    end_piece: i64,
    end_span: i64,
    piece: Piece,
    span: Span,
}

impl QueuedPath {
    /// Ends the path near the point where the motion can come to rest, or a little further if it can then blend into the move, and drops
    /// the remainder. A motion that runs backwards must come to rest first.
    pub(super) fn abort(&mut self, asked: &QueuedMove, around: &Surroundings, run: &Run) -> Result<(), Refusal> {
        for end in ENDS {
            self.end_at(end, run)?;
            if self.tip.blend > 0.0
                && let Ok(Some(draft)) = self.draft(asked, around, true)
                && self.corner(asked, &draft, around, run).reach > 0.0
            {
                break;
            }
        }
        Ok(())
    }

    /// Ends the path at a multiple of the stopping distance.
    fn end_at(&mut self, end: f64, run: &Run) -> Result<(), Refusal> {
        if self.end_piece == self.first_piece {
            return Ok(());
        }
        if run.direction < 0.0 && !run.is_at_rest() {
            return Err(Refusal::Full);
        }
        let (number, rest) = run.resting(self);
        let length = self.piece(number).length;
        let s = (rest + (end - 1.0) * if run.piece == number { rest - run.s } else { rest }).min(length);
        let is_whole = number == self.end_piece - 1 && s == length;
        if !is_whole && !MARGINS.iter().any(|margin| self.cut(number, (s + margin * length).min(length), run)) {
            return Err(Refusal::Full);
        }
        let last = *self.piece(number);
        let place = (last.number - 1) as f64 + last.to;
        while self.end_mark > self.first_mark && self.mark_of(self.end_mark - 1).place > place {
            self.end_mark -= 1;
        }
        let begun = if last.to < 1.0 { last.number } else { last.number + 1 };
        (begun..=self.tip.number).for_each(|number| self.note_aborted(number));
        let end = self.place(&last, last.length);
        (self.end, self.end_piece) = (end.q, number + 1);
        let ahead = if run.piece == number { last.length - run.s } else { last.length };
        self.tip = Tip {
            number: last.number,
            kind: 0,
            length: 2.0 * last.length,
            blend: if run.is_at_rest() { 0.0 } else { REACH * ahead },
            scale: 0.0,
            speed: last.speed,
            linear: last.linear,
            acceleration: last.joints,
        };
        Ok(())
    }

    /// Records that a move has been replaced by a later one.
    pub fn note_aborted(&mut self, number: i64) {
        *self.end_of(number) = MoveEnd { number, kept: 0.0, reason: Shrunk::Aborted as i64 };
    }

    /// Shortens a piece, which becomes the last one. Returns false, and changes nothing, if the motion cannot follow the shortened path.
    fn cut(&mut self, number: i64, length: f64, run: &Run) -> bool {
        let mut piece = *self.piece(number);
        let (last, s) = self.span_at(&piece, length);
        let before = Before { end_piece: self.end_piece, end_span: self.end_span, piece, span: *self.span(last) };
        let [kept, _] = before.span.divided(s);
        *self.span_mut(last) = kept;
        piece.to = if length == piece.length { piece.to } else { piece.from + (piece.to - piece.from) * (length / piece.length) };
        (piece.length, piece.spans, piece.stops) = (length, last + 1 - piece.first, 0);
        *self.piece_mut(number) = piece;
        (self.end_piece, self.end_span) = (number + 1, last + 1);
        self.update_exits(run.piece);
        if run.can_follow(self) {
            return true;
        }
        (self.end_piece, self.end_span) = (before.end_piece, before.end_span);
        *self.span_mut(last) = before.span;
        *self.piece_mut(number) = before.piece;
        self.update_exits(run.piece);
        false
    }
}
