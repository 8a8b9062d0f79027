// SPDX-License-Identifier: Apache-2.0
//! Values that outlive whoever stores them. An SVV has a stamp beside its value in each image, and, where it has a history, a ring of its
//! last values. The block that stores the value stamps it and appends it at the end of its firing, whichever block that is: so number, time
//! and history go on from one writer to the next, and nobody who was not due, or who faulted, leaves anything there.
use crate::connection::RowsEnd;
use crate::memory::Span;
use crate::table::Table;
use crate::{Block, BlockId, Cell, STAMP_LEN};
use opengpac::abi::Header;
use std::collections::HashMap;
use std::sync::Arc;

/// The time in the stamp of a value that no block has stored.
pub const NEVER_NS: i64 = i64::MIN;

/// The stamp of a value that no block has stored.
pub fn unstamped() -> [u8; STAMP_LEN] {
    let mut bytes = [0; STAMP_LEN];
    bytes[8..16].copy_from_slice(&NEVER_NS.to_ne_bytes());
    bytes
}

/// A value that a block stores, with what belongs to the value and not to the block.
#[derive(Clone)]
pub struct Stamped {
    /// The block that stores it.
    pub block: Arc<Block>,
    /// n where its output is a ratio output n, else 1: it stores on the nth, 2nth, … invocation.
    pub ratio: u32,
    /// [`STAMP_LEN`] bytes: number (u64) and time (i64) of the invocation that stored it last, and the number at activation (u64).
    pub stamp: Cell,
    /// The value, and the ring of its last values: one row for each value stored.
    pub history: Option<(Cell, Arc<RowsEnd>)>,
}

/// The same as a firing uses it.
pub(crate) struct Mark {
    step: u32,
    ratio: u64,
    header: *const Header,
    stamp: *mut u8,
    row: Option<[Span; 1]>,
    pub(crate) of: Stamped,
}

/// Those of a table, by activation.
#[derive(Default)]
pub(crate) struct Marks {
    pub(crate) all: Vec<Mark>,
    /// For each slot its part of `all`.
    ranges: Vec<(u32, u32)>,
}

impl Table {
    /// The same with values that are stamped where its blocks store them; those of other blocks are left out.
    #[must_use]
    pub fn with_stamped(mut self, stamped: Vec<Stamped>) -> Table {
        let blocks = self.steps.iter().zip(0..).filter_map(|(step, index)| Some((step.block.as_ref()?.id(), index)));
        let steps: HashMap<BlockId, u32> = blocks.collect();
        let mark = |of: Stamped| {
            assert!(of.stamp.len() >= STAMP_LEN, "a stamp has {STAMP_LEN} bytes: a number, a time, and the number at activation");
            let step = *steps.get(&of.block.id())?;
            let header = self.header(step)?.cast_const();
            let row = of.history.as_ref().map(|(value, _)| [Span { start: value.start(), at: 0, len: value.len() }]);
            Some(Mark { step, ratio: u64::from(of.ratio.max(1)), header, stamp: of.stamp.start(), row, of })
        };
        let mut all: Vec<Mark> = stamped.into_iter().filter_map(mark).collect();
        let slot = |mark: &Mark| self.steps[mark.step as usize].slot;
        all.sort_by_key(slot);
        let range = |of: u32| (all.partition_point(|mark| slot(mark) < of) as u32, all.partition_point(|mark| slot(mark) <= of) as u32);
        let ranges = if all.is_empty() { Vec::new() } else { (0..self.activations.len() as u32).map(range).collect() };
        self.marks = Marks { all, ranges };
        self
    }

    /// Stamps what the blocks of the activation at `slot` have stored in this firing. `careful`: only those that ran and did not fault.
    ///
    /// # Safety
    /// Called by the kernel of the table's source alone, while no step runs.
    #[inline]
    pub(crate) unsafe fn stamp(&self, slot: usize, now_ns: i64, careful: bool) {
        let Some(&(start, end)) = self.marks.ranges.get(slot) else { return };
        for mark in &self.marks.all[start as usize..end as usize] {
            if careful && !self.ran[mark.step as usize] {
                continue;
            }
            // SAFETY: the block is held and no step runs; its number is that of the next invocation.
            let (next, activated) = unsafe { ((*mark.header).number, (*mark.header).activated) };
            if mark.ratio > 1 && !next.wrapping_sub(activated).is_multiple_of(mark.ratio) {
                continue;
            }
            let number = next.wrapping_sub(1);
            // SAFETY: the stamp is held and has its length (checked when the table was built); this source's own image.
            unsafe {
                mark.stamp.cast::<u64>().write_unaligned(number);
                mark.stamp.add(8).cast::<i64>().write_unaligned(now_ns);
                mark.stamp.add(16).cast::<u64>().write_unaligned(activated);
            }
            if let (Some(value), Some((_, rows))) = (&mark.row, &mark.of.history) {
                // SAFETY: this is the kernel of the source whose image the value lies in, which alone writes the ring.
                unsafe { rows.write(number, now_ns, value) };
            }
        }
    }
}
