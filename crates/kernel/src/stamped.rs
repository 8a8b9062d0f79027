// SPDX-License-Identifier: Apache-2.0
//! Values that outlive the block that stores them. In addition to its value in each image, an SVV has a stamp and, if it has a history, a
//! ring of its most recent values. A block that stores the value also stamps and appends it at the end of its firing. Number, time and
//! history thus continue from one writer to the next, and a block that was not due or that faulted leaves no trace.
use crate::block::{Block, BlockId};
use crate::memory::{Cell, Span};
use crate::phase::STAMP_LEN;
use crate::rows::RowsEnd;
use opengpac::abi::Header;
use std::sync::Arc;

/// Time in the stamp of a value that has never been stored by a block.
pub const NEVER_NS: i64 = i64::MIN;

/// Returns the stamp of a value that has never been stored by a block.
pub fn unstamped() -> [u8; STAMP_LEN] {
    let mut bytes = [0; STAMP_LEN];
    bytes[8..16].copy_from_slice(&NEVER_NS.to_ne_bytes());
    bytes
}

/// A value that a block stores, with the data that belongs to the value rather than to the block.
#[derive(Clone)]
pub struct StampedValue {
    /// Block that stores the value.
    pub block: Arc<Block>,
    /// n if the block's output is a ratio output n, else 1: the value is stored by invocations n, 2n, ….
    pub ratio: u32,
    /// [`STAMP_LEN`] bytes: number (u64) and time (i64) of the last invocation that stored it, and the number at activation (u64).
    pub stamp: Cell,
    /// The value, and the ring of its most recent values, with one row for each value stored.
    pub history: Option<(Cell, Arc<RowsEnd>)>,
}

/// A stamped value, prepared for use in firings.
pub struct Mark {
    step: u32,
    ratio: u64,
    header: *const Header,
    stamp: *mut u8,
    row: Option<[Span; 1]>,
    pub of: StampedValue,
}

/// Stamps of a table, by activation.
#[derive(Default)]
pub struct Marks {
    pub all: Vec<Mark>,
    /// Range of `all` for each slot.
    ranges: Vec<(u32, u32)>,
}

impl Marks {
    /// Creates the stamps of a table with `slots` activations. `found` returns the step, slot and header of a block. Values of blocks
    /// that are not in the table are left out.
    pub(crate) fn new(stamped: Vec<StampedValue>, slots: usize, found: impl Fn(BlockId) -> Option<(u32, u32, *const Header)>) -> Marks {
        let mark = |of: StampedValue| {
            assert!(of.stamp.len() >= STAMP_LEN, "a stamp has {STAMP_LEN} bytes: a number, a time, and the number at activation");
            let (step, slot, header) = found(of.block.id())?;
            let row = of.history.as_ref().map(|(value, _)| [Span { start: value.start(), at: 0, len: value.len() }]);
            Some((slot, Mark { step, ratio: u64::from(of.ratio.max(1)), header, stamp: of.stamp.start(), row, of }))
        };
        let mut all: Vec<(u32, Mark)> = stamped.into_iter().filter_map(mark).collect();
        all.sort_by_key(|(slot, _)| *slot);
        let range = |of: u32| (all.partition_point(|(slot, _)| *slot < of) as u32, all.partition_point(|(slot, _)| *slot <= of) as u32);
        let ranges = if all.is_empty() { Vec::new() } else { (0..slots as u32).map(range).collect() };
        Marks { all: all.into_iter().map(|(_, mark)| mark).collect(), ranges }
    }

    /// Stamps the values that blocks of the activation at `slot` stored in this firing; with `ran`, only the values of steps that ran and
    /// did not fault.
    ///
    /// # Safety
    /// Must be called only by the kernel of the table's source, while no step runs.
    #[inline]
    pub(crate) unsafe fn stamp(&self, slot: usize, now_ns: i64, ran: Option<&[bool]>) {
        let Some(&(start, end)) = self.ranges.get(slot) else { return };
        for mark in &self.all[start as usize..end as usize] {
            if ran.is_some_and(|ran| !ran[mark.step as usize]) {
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
