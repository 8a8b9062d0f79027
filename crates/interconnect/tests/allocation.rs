// SPDX-License-Identifier: Apache-2.0
//! Checks that the calls of a firing on a connection in memory, and on a ring of rows, neither allocate nor free.
#![cfg(not(loom))]
use interconnect::{Carrier, ConnectionSpec, Memory, rows};
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
fn a_connection_in_memory_allocates_only_when_it_is_made() {
    let spec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: 100, queue_row_len: 20, queue_depth: 3 };
    let (mut sender, mut receiver) = Memory.connect(&spec);
    let firings = || {
        for number in 0..100 {
            sender.group().fill(number as u8);
            sender.publish(number, 0);
            let pushed = sender.push(number, 0, &mut |row| row.fill(number as u8));
            // At every fourth firing of the writer the reader is late, so that the queue also fills up.
            if number % 4 != 3 {
                assert!(receiver.latch(0).is_some());
                while receiver.peek_row().is_some() {
                    receiver.pop_row();
                }
            }
            assert!(pushed.is_ok());
        }
        while sender.push(0, 0, &mut |row| row.fill(0)).is_ok() {}
    };
    assert_eq!(calls(firings), 0);
}

#[test]
fn a_ring_of_rows_allocates_only_when_it_is_made() {
    let (mut writer, _reader) = rows(30, 4);
    let firings = || {
        for number in 0..100 {
            writer.write(number, 0, |sink| {
                sink.put(&[1; 13]);
                sink.put(&[2; 17]);
            });
        }
    };
    assert_eq!(calls(firings), 0);
}
