// SPDX-License-Identifier: Apache-2.0
//! An allocator that counts the allocations of each thread; the simulator's binary and its tests use it.
use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::cell::Cell;

pub struct Counting;

thread_local! {
    /// Live bytes, number of allocations, and total bytes allocated by this thread.
    static COUNTS: Cell<(i64, u64, u64)> = const { Cell::new((0, 0, 0)) };
}

// SAFETY: the system's allocator does all work; the counting is independent of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // A thread that is exiting has no count.
        let _counted = COUNTS.try_with(|counts| {
            let (live, count, bytes) = counts.get();
            counts.set((live + layout.size() as i64, count + 1, bytes + layout.size() as u64));
        });
        // SAFETY: the caller's contract is passed on.
        unsafe { Heap.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        let _counted = COUNTS.try_with(|counts| {
            let (live, count, bytes) = counts.get();
            counts.set((live - layout.size() as i64, count, bytes));
        });
        // SAFETY: the caller's contract is passed on.
        unsafe { Heap.dealloc(at, layout) }
    }
}

/// Returns the live bytes, number of allocations, and total bytes allocated by this thread; zeros if [`Counting`] is not the allocator.
pub fn counts() -> (i64, u64, u64) {
    COUNTS.get()
}

/// Runs `of` and counts its allocations.
pub fn counted<T>(work: &mut u64, of: impl FnOnce() -> T) -> T {
    let before = counts().1;
    let result = of();
    *work += counts().1 - before;
    result
}
