// SPDX-License-Identifier: Apache-2.0
//! Marks: positions on the path at which an output is switched. The state of the outputs depends only on the position, so a step back
//! undoes the switching.
use super::{QueuedPath, Refusal, Sample};
use opengpac::Type;

/// Maximum number of marks of one move, and of a path.
pub const MARKS_OF_MOVE: usize = 4;
pub const MARKS_MAX: usize = 64;
/// Number of outputs.
pub const OUTPUTS_MAX: usize = 16;

/// A request to switch an output at a distance before the goal of a move.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct MarkWish {
    /// Index of the output, from 1; 0: none.
    pub output: i32,
    /// 1 on, 0 off.
    pub on: i32,
    /// Distance before the goal along the path of the move, in `unit`: 0 fraction of the move, 1 rad, 2 m of the tool.
    pub before: f64,
    pub unit: i64,
    /// Time by which the output is switched before that position is reached, s.
    pub ahead: f64,
}

/// A position on the path at which an output is switched.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
pub struct Mark {
    /// Position of the mark: number of completed moves plus the fraction of the next one.
    pub place: f64,
    pub output: i32,
    pub on: i32,
    pub ahead: f64,
}

/// State of the outputs as bit masks: outputs that have been switched, and outputs that are on. Output i is bit i - 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    pub switched: i64,
    pub on: i64,
}

impl Outputs {
    fn switch(&mut self, mark: &Mark) {
        let bit = 1 << (mark.output - 1);
        self.switched |= bit;
        self.on = if mark.on != 0 { self.on | bit } else { self.on & !bit };
    }
}

impl QueuedPath {
    /// Adds marks, which must be in the order of their positions.
    pub(super) fn add_marks(&mut self, marks: impl Iterator<Item = Mark>) {
        for mark in marks {
            self.marks[self.end_mark.rem_euclid(MARKS_MAX as i64) as usize] = mark;
            self.end_mark += 1;
        }
    }

    /// Drops passed marks until there is space for the marks of a move.
    pub(super) fn make_room_for_marks(&mut self, place: f64) -> Result<(), Refusal> {
        while self.end_mark - self.first_mark > (MARKS_MAX - MARKS_OF_MOVE) as i64 {
            let oldest = *self.mark_of(self.first_mark);
            if oldest.place > place {
                return Err(Refusal::Full);
            }
            let mut outputs = Outputs { switched: self.switched, on: self.on };
            outputs.switch(&oldest);
            (self.switched, self.on) = (outputs.switched, outputs.on);
            self.first_mark += 1;
        }
        Ok(())
    }

    /// Returns the state of the outputs at the position of a sample.
    pub fn outputs(&self, now: &Sample) -> Outputs {
        let mut outputs = Outputs { switched: self.switched, on: self.on };
        for number in self.first_mark..self.end_mark {
            let mark = self.mark_of(number);
            if mark.place <= now.place() + now.place_rate * mark.ahead {
                outputs.switch(mark);
            }
        }
        outputs
    }

    pub(super) fn mark_of(&self, number: i64) -> &Mark {
        &self.marks[number.rem_euclid(MARKS_MAX as i64) as usize]
    }
}
