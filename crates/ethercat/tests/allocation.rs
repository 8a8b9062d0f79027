// SPDX-License-Identifier: Apache-2.0
//! Checks that a cycle allocates nothing, by counting every allocation of the exchanging thread: with lost and corrupted frames, axes
//! that are engaged and released, faults that are reset, and axes that recover.
mod common;
use common::{COUNTS, OPERATION_ENABLED, Rig, drive};
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

const AXES: usize = 8;

/// Returns the number of the driver's allocations in `cycles` cycles, with an action on the segment before each.
fn allocations(rig: &mut Rig, cycles: usize, mut before: impl FnMut(&Rig, usize)) -> u64 {
    let mut counted = 0;
    for cycle in 0..cycles {
        before(rig, cycle);
        let engaged: [bool; AXES] = std::array::from_fn(|axis| (cycle + axis) % 50 != 0);
        let goals: Vec<u8> = (0..AXES).flat_map(|_| 1.0f64.to_ne_bytes()).collect();
        counted += rig.raw(&goals, &engaged, || ALLOCATIONS.with(Cell::get));
    }
    counted
}

#[test]
fn the_counter_counts() {
    let before = ALLOCATIONS.with(Cell::get);
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(ALLOCATIONS.with(Cell::get), before + 1);
}

#[test]
fn a_cycle_allocates_nothing_with_all_axes_in_op() {
    let names: Vec<String> = (0..AXES).map(|axis| format!("a{axis}")).collect();
    let drives: Vec<_> = names.iter().map(|name| drive(name, 1000)).collect();
    let mode = |axis: usize| ["position", "velocity", "torque"][axis % 3];
    let axes: Vec<_> =
        (0..AXES).map(|axis| json!({ "name": names[axis], "counts": COUNTS, "mode": mode(axis), "rated_torque": 1.0, "speed_max": 10 })).collect();
    let mut rig = Rig::with(&drives, json!({ "axes": axes, "sync0_ns": 1_000_000 }));
    let goals = [Some(1.0); AXES];
    rig.until(&goals, "all in operation", |rig| names.iter().all(|name| rig.status(name) == OPERATION_ENABLED));
    assert_eq!(allocations(&mut rig, 1000, |_, _| {}), 0);
    // Two frames that do not return, one that is corrupted; a drive that has a fault for a while.
    let disturb = |rig: &Rig, cycle: usize| match cycle % 20 {
        5 => rig.server.lock().lose(2),
        15 => rig.server.lock().spoil(1),
        _ => {}
    };
    assert_eq!(allocations(&mut rig, 1000, disturb), 0);
    assert_eq!((rig.counter("frames_lost") > 0, rig.counter("cycles") > 2000), (true, true));
    // An axis that loses and regains power: the device is lost, which allocates its reason, and recovers.
    rig.server.lock().power(3, false);
    let lost = (0..3).find_map(|_| rig.exchange(&[]).err()).expect("lost within three cycles");
    assert!(lost.message.contains("axis 'a3' at place 3"), "{}", lost.message);
    rig.server.lock().power(3, true);
    rig.reset();
    rig.until(&goals, "all in operation again", |rig| names.iter().all(|name| rig.status(name) == OPERATION_ENABLED));
    assert_eq!(allocations(&mut rig, 1000, disturb), 0);
}
