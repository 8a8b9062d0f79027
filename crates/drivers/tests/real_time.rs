// SPDX-License-Identifier: Apache-2.0
//! Checks that reading and writing allocate nothing, by counting every allocation of this program.
//!
//! Allocations of MuJoCo within its step are made by the C library and are not counted.
mod common;
use common::{Machine, robot, with_mujoco};
use serde_json::json;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's contract is the one that is required.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn allocations(mut machine: Machine, engaged: &[bool]) -> u64 {
    let run = |machine: &mut Machine, from: i64| {
        for k in from..from + 300 {
            machine.read(k * 1_000_000);
            machine.write(k * 1_000_000, if k % 3 == 0 { &[false; 7] } else { engaged });
        }
    };
    run(&mut machine, 1);
    let before = ALLOCATIONS.with(Cell::get);
    run(&mut machine, 301);
    ALLOCATIONS.with(Cell::get) - before
}

#[test]
fn the_counter_counts() {
    let before = ALLOCATIONS.with(Cell::get);
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(ALLOCATIONS.with(Cell::get), before + 1);
}

#[test]
fn a_plant_allocates_nothing_after_it_is_open() {
    with_mujoco(|library| {
        let machine = Machine::open("mujoco", json!({ "path": robot("ur5e.xml"), "library": library }));
        // Some joints commanded, some braked: the whole path.
        assert_eq!(allocations(machine, &[true, true, false, true, true, false, true]), 0);
    });
    let loopback = json!({ "parts": ["a", "b"] });
    let machine = Machine::open("loopback", loopback.clone());
    assert_eq!(allocations(machine, &[true; 2]), 0);
    let apart = json!({ "driver": { "kind": "loopback", "options": loopback }, "command": [env!("CARGO_BIN_EXE_opengpac-plant")], "silent_ns": i64::MAX });
    assert_eq!(allocations(Machine::open("plant_process", apart), &[true; 2]), 0);
}
