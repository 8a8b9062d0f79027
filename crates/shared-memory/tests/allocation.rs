// SPDX-License-Identifier: Apache-2.0
//! Checks that the calls of a firing on ends in shared memory neither allocate nor free.
use interconnect::{ConnectionSpec, Ends};
use shared_memory::{SharedMemory, new_run};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    /// Number of allocator calls by this thread.
    static CALLS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is passed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.set(CALLS.get() + 1);
        // SAFETY: the caller's contract is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        CALLS.set(CALLS.get() + 1);
        // SAFETY: the caller's contract is passed on.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Returns the number of allocator calls that `run` makes.
fn calls(run: impl FnOnce()) -> usize {
    let before = CALLS.get();
    run();
    CALLS.get() - before
}

#[test]
fn an_allocation_is_counted() {
    assert_eq!(calls(|| drop(std::hint::black_box(Box::new(1)))), 2);
}

#[test]
fn ends_allocate_only_when_they_are_made_also_while_the_other_comes_and_goes() {
    let spec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 100, queue_row_len: 20, queue_depth: 3 };
    let mut ends = SharedMemory::new("allocation", new_run()).expect("there is shared memory");
    let mut sender = ends.sender(1, &spec).expect("the end is free");
    let mut number = 0;
    let mut write = || {
        for _ in 0..10 {
            number += 1;
            sender.group().fill(number as u8);
            sender.publish(number, 0);
            // Without a reader the queue fills up.
            sender.push(number, 0, &mut |row| row.fill(number as u8)).ok();
        }
    };
    for _ in 0..3 {
        assert_eq!(calls(&mut write), 0);
        let mut receiver = ends.receiver(1, &spec, Box::new(|| ())).expect("the end is free");
        let read = || {
            assert!(receiver.latch(0).is_some());
            assert!(receiver.latch(0).is_none());
            while receiver.peek_row().is_some() {
                receiver.pop_row();
            }
        };
        assert_eq!(calls(read), 0);
        assert_eq!(calls(&mut write), 0);
    }
}
