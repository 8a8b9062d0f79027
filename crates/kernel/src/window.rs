// SPDX-License-Identifier: Apache-2.0
//! Windows: the n most recent values of an SVV or private cell in contiguous memory, oldest first, for blocks that declare a history.
//!
//! A window is image memory like any other cell. The kernel of the source that stores the value appends to it in the same firing, and it
//! is sent to other sources in the asynchronous group with the value, so no reader sees a half-written window.
use crate::memory::Cell;
use std::ptr;

/// The most recent values of a cell.
#[derive(Clone)]
pub struct Window {
    cell: Cell,
    /// Size of one value in bytes.
    len: usize,
}

impl Window {
    /// Creates a window in `cell`. Panics unless the cell's length is a multiple of `len`, the length of a value.
    pub fn new(cell: Cell, len: usize) -> Window {
        assert!(len > 0 && !cell.is_empty() && cell.len().is_multiple_of(len), "a window of {} bytes does not hold values of {len}", cell.len());
        Window { cell, len }
    }

    /// Returns the window's memory, for binding and for connections.
    pub fn cell(&self) -> &Cell {
        &self.cell
    }

    /// Returns true if the cell has the size of one value.
    pub(crate) fn takes(&self, value: &Cell) -> bool {
        value.len() == self.len
    }

    /// Sets every value to `bytes`. Called before anything that runs is bound to the window, or by the kernel of its source.
    pub fn fill(&self, bytes: &[u8]) {
        assert_eq!(bytes.len(), self.len, "a window takes values of its own length");
        for at in (0..self.cell.len()).step_by(self.len) {
            // SAFETY: the window lies within its cell, and a value fits at `at`; the caller keeps to the condition above.
            unsafe { self.cell.start().add(at).copy_from_nonoverlapping(bytes.as_ptr(), self.len) };
        }
    }

    /// Sets every value to the current value of `value`. Called by the kernel of its source.
    pub(crate) fn fill_from(&self, value: &Cell) {
        for at in (0..self.cell.len()).step_by(self.len) {
            // SAFETY: both cells are held, of this length (checked when the script was made); this source's own image.
            unsafe { ptr::copy(value.start(), self.cell.start().add(at), self.len) };
        }
    }

    /// Appends the current value of `value` and drops the oldest. Wait-free: moves the window once. Called by the kernel of its source.
    #[inline]
    pub(crate) fn append(&self, value: &Cell) {
        let kept = self.cell.len() - self.len;
        // SAFETY: as in `fill_from`; `kept` and one value are the whole window.
        unsafe {
            ptr::copy(self.cell.start().add(self.len), self.cell.start(), kept);
            ptr::copy(value.start(), self.cell.start().add(kept), self.len);
        }
    }
}
