// SPDX-License-Identifier: Apache-2.0
//! An allocator that counts what each thread has: the simulator's binary and its tests take it as theirs.
use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::cell::Cell;

pub struct Counting;

thread_local! {
    /// Bytes that live, allocations, bytes that were ever allocated; of this thread.
    static COUNTS: Cell<(i64, u64, u64)> = const { Cell::new((0, 0, 0)) };
}

// SAFETY: everything is done by the system's allocator; the count is beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // A thread that ends has no count any more.
        let _counted = COUNTS.try_with(|counts| {
            let (live, count, bytes) = counts.get();
            counts.set((live + layout.size() as i64, count + 1, bytes + layout.size() as u64));
        });
        // SAFETY: as for the caller.
        unsafe { Heap.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        let _counted = COUNTS.try_with(|counts| {
            let (live, count, bytes) = counts.get();
            counts.set((live - layout.size() as i64, count, bytes));
        });
        // SAFETY: as for the caller.
        unsafe { Heap.dealloc(at, layout) }
    }
}

/// Bytes that live, allocations and bytes so far, of this thread. Zeros where [`Counting`] is not the allocator.
pub fn counts() -> (i64, u64, u64) {
    COUNTS.get()
}

/// Runs `of`, and counts its allocations.
pub fn counted<T>(work: &mut u64, of: impl FnOnce() -> T) -> T {
    let before = counts().1;
    let result = of();
    *work += counts().1 - before;
    result
}
