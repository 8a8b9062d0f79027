// SPDX-License-Identifier: Apache-2.0
//! Selection of the block of a table that the probe visits in a firing.
use crate::containment::OUTSIDE;

/// Order of the probe's visits in a table.
#[derive(Default)]
pub(crate) struct Visits {
    turn: u64,
    strips: Vec<Visit>,
}

/// Visit state of one strip: the turn of the last visit, and the next block.
struct Visit {
    turn: u64,
    next: u32,
}

impl Visits {
    /// Creates the visits of a table, starting with the first block of each strip.
    pub(crate) fn begin(first: impl Iterator<Item = Option<u32>>) -> Visits {
        Visits { turn: 0, strips: first.map(|first| Visit { turn: 0, next: first.unwrap_or(OUTSIDE) }).collect() }
    }

    /// Returns the due strip that has not been visited for the longest time, and its next block, so that even a strip that is rarely due
    /// is visited. Returns `None` if no block is due.
    pub(crate) fn due(&self, due: impl Fn(usize) -> bool) -> Option<(usize, u32)> {
        let due = self.strips.iter().enumerate().filter(|(strip, visit)| visit.next != OUTSIDE && due(*strip));
        due.min_by_key(|(_, visit)| visit.turn).map(|(strip, visit)| (strip, visit.next))
    }

    /// Records the visit of strip `strip` in this turn; `next` is the block to visit next.
    pub(crate) fn visited(&mut self, strip: usize, next: u32) {
        self.turn += 1;
        self.strips[strip] = Visit { turn: self.turn, next };
    }
}
