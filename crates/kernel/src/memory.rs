// SPDX-License-Identifier: Apache-2.0
//! Images: the memory that the blocks of one interrupt source load from and store to.
use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};
use std::ptr::NonNull;
use std::sync::Arc;

/// Zeroed memory of one image, aligned to a cache line, at an address that is stable as long as the extent is held. An image is the set
/// of extents of its source: one for each verb instance (its private cells and its blocks, side by side), and one for each group of SVVs
/// that were created together. Freeing a verb instance frees its extents.
pub struct Extent {
    start: NonNull<u8>,
    len: usize,
}

// SAFETY: an extent owns plain bytes. Who may touch which of them when is the kernel's rule: the source whose image it is,
// between and during its firings, and others only before anything that runs is bound to it.
unsafe impl Send for Extent {}
// SAFETY: as for `Send`.
unsafe impl Sync for Extent {}

const LINE: usize = 64;
const PAGE: usize = 4096;

impl Extent {
    /// Creates a zeroed extent of `len` bytes, touched so that no page fault occurs later.
    pub fn new(len: usize) -> Arc<Extent> {
        let layout = layout(len);
        // SAFETY: `layout` is never of size zero.
        let start = NonNull::new(unsafe { alloc_zeroed(layout) }).unwrap_or_else(|| handle_alloc_error(layout));
        for at in (0..len).step_by(PAGE) {
            // SAFETY: `at` lies within the allocation.
            unsafe { start.as_ptr().add(at).write_volatile(0) };
        }
        Arc::new(Extent { start, len })
    }

    /// Returns the length in bytes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if the length is 0.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the cell of `len` bytes at `offset`; `None` if it is out of bounds.
    pub fn find(self: &Arc<Self>, offset: usize, len: usize) -> Option<Cell> {
        (offset.checked_add(len)? <= self.len).then(|| Cell { extent: self.clone(), offset, len })
    }

    /// Returns the cell of `len` bytes at `offset`. Panics if it is out of bounds.
    pub fn cell(self: &Arc<Self>, offset: usize, len: usize) -> Cell {
        let end = offset.checked_add(len);
        assert!(end.is_some_and(|end| end <= self.len), "a cell of {len} bytes at {offset} does not lie in an extent of {} bytes", self.len);
        Cell { extent: self.clone(), offset, len }
    }
}

impl Drop for Extent {
    fn drop(&mut self) {
        // SAFETY: allocated in `new` with the same layout.
        unsafe { dealloc(self.start.as_ptr(), layout(self.len)) };
    }
}

fn layout(len: usize) -> Layout {
    Layout::from_size_align(len.max(1).next_multiple_of(LINE), LINE).expect("an image is far smaller than the address space")
}

/// Part of an extent, kept alive while it is held. Steps and scripts keep the cells that they access.
#[derive(Clone)]
pub struct Cell {
    extent: Arc<Extent>,
    offset: usize,
    len: usize,
}

impl Cell {
    /// Returns the length in bytes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if the length is 0.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns a part of this cell. Panics if it is out of bounds.
    pub fn part(&self, offset: usize, len: usize) -> Cell {
        let end = offset.checked_add(len);
        assert!(end.is_some_and(|end| end <= self.len), "a part of {len} bytes at {offset} does not lie in a cell of {} bytes", self.len);
        Cell { extent: self.extent.clone(), offset: self.offset + offset, len }
    }

    /// Returns the cell of `len` bytes that starts at the same address, to merge adjacent cells. Panics if it exceeds the extent.
    pub fn widened(&self, len: usize) -> Cell {
        self.extent.cell(self.offset, len)
    }

    /// Stores `bytes` directly. Allowed only before the cell is bound to anything that runs (preparation) or, under the virtual clock or
    /// from a driver's own source, between two firings; a running system changes cells by [`crate::Op::Store`].
    pub fn store(&self, bytes: &[u8]) {
        assert_eq!(bytes.len(), self.len, "a cell takes exactly its own number of bytes");
        // SAFETY: the cell lies within its extent; the caller keeps to the condition above.
        unsafe { self.start().copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
    }

    /// Returns the bytes. Consistent only under the same condition as `store`; a running system reads through rows or `Op::Capture`.
    pub fn load(&self) -> Vec<u8> {
        // SAFETY: the cell lies within its extent, all of which is initialised.
        unsafe { std::slice::from_raw_parts(self.start(), self.len) }.to_vec()
    }

    /// Returns true if both cells are the same memory.
    pub fn is_same(&self, other: &Cell) -> bool {
        self.start() == other.start() && self.len() == other.len()
    }

    /// Returns true if `next` starts where this one ends, in the same extent.
    pub fn adjoins(&self, next: &Cell) -> bool {
        Arc::ptr_eq(&self.extent, &next.extent) && self.offset + self.len == next.offset
    }

    /// Returns the extent that contains the cell, and the cell's offset.
    pub fn place(&self) -> (&Arc<Extent>, usize) {
        (&self.extent, self.offset)
    }

    /// Returns the address of the first byte; valid for `len` bytes while the cell is held.
    pub fn start(&self) -> *mut u8 {
        // SAFETY: the offset lies within the extent (checked when the cell was made).
        unsafe { self.extent.start.as_ptr().add(self.offset) }
    }
}

/// Range of adjacent cells, and its offset in a group of bytes.
#[derive(Clone, Copy)]
pub struct Span {
    pub(crate) start: *mut u8,
    pub(crate) at: usize,
    pub(crate) len: usize,
}

/// Returns the minimum set of copies that transfer `cells`, in sequence, to or from a group of bytes, and the group's length.
pub(crate) fn spans(cells: &[Cell]) -> (Vec<Span>, usize) {
    let mut spans: Vec<Span> = Vec::new();
    let mut at = 0;
    for (index, cell) in cells.iter().enumerate() {
        match spans.last_mut() {
            Some(last) if index > 0 && cells[index - 1].adjoins(cell) => last.len += cell.len(),
            _ => spans.push(Span { start: cell.start(), at, len: cell.len() }),
        }
        at += cell.len();
    }
    (spans, at)
}
