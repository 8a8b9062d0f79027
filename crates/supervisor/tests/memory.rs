// SPDX-License-Identifier: Apache-2.0
//! Checks that creating and deleting verb instances leaves nothing: the allocator of this test counts live bytes, and the allocations and
//! bytes of each round.
mod common;
use common::*;
use serde_json::json;
use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::sync::atomic::{AtomicIsize, AtomicUsize, Ordering};

struct Counting;

static LIVE: AtomicIsize = AtomicIsize::new(0);
/// Totals since the start: number of allocations, and bytes.
static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);
static ALLOCATED: AtomicUsize = AtomicUsize::new(0);

// SAFETY: the system's allocator does everything; counting is independent of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE.fetch_add(layout.size() as isize, Ordering::Relaxed);
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        ALLOCATED.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's contract is passed on.
        unsafe { Heap.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size() as isize, Ordering::Relaxed);
        // SAFETY: the caller's contract is passed on.
        unsafe { Heap.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn round(rig: &Rig, at: usize) {
    let places: [&[&str]; 2] = [&["a=x", "b=y", "count@rtp0.fast", "probe@rtp1.soft", "watch@rtp0.slow"], &["a=x", "b=y", "*@rtp0.fast", "watch@rtp0.slow"]];
    let id = rig.instance("v", places[at % 2]);
    rig.start(id);
    rig.advance(5);
    rig.system.halt(id).unwrap();
    rig.wait(id);
    rig.system.delete(id).unwrap();
    seen(0);
}

/// Returns the allocations of `rounds` rounds: their number, and bytes.
fn work(rig: &Rig, rounds: usize) -> [usize; 2] {
    let now = || [ALLOCATIONS.load(Ordering::Relaxed), ALLOCATED.load(Ordering::Relaxed)];
    let before = now();
    (0..rounds).for_each(|at| round(rig, at));
    let after = now();
    [after[0] - before[0], after[1] - before[1]]
}

#[test]
fn ten_thousand_instances_leave_nothing() {
    let rig = Rig::new(Link::Memory);
    ["x", "y"].iter().for_each(|name| rig.svv_of(name, json!({"type_text": "double", "history": 100})));
    rig.define(verb(
        "v",
        &[("count", "t.count"), ("probe", "t.probe"), ("watch", "t.watch")],
        json!({"instantiation_parameters": {"a": ["count.y", "probe.u", "watch.u"], "b": ["watch.y"]}, "cells": {"t": ["count.total"], "p": ["probe.y"]},
               "input_parameters": {"limit": {"targets": ["probe.limit"], "default": 2.0}},
               "output_values": {"y": "probe.y"}, "conditions": {"above": {"on": ["probe.above"]}, "halted": {"returns": ["y"]}},
               "initial": "start", "transitions": tau(&["start, above -> start"]),
               "command_lists": lists(&[("start", &["*count", "+count 1ms", "+probe", "+watch 4ms"])])}),
    ));
    // The log and the tables of names first grow to their full size.
    for at in 0..4_000 {
        round(&rig, at);
    }
    let before = LIVE.load(Ordering::Relaxed);
    let first = work(&rig, 1_000);
    (0..8_000).for_each(|at| round(&rig, at));
    let last = work(&rig, 1_000);
    let grown = LIVE.load(Ordering::Relaxed) - before;
    assert!(grown.abs() < 64 * 1024, "{grown} bytes more after 10,000 instances");
    for (first, last) in first.into_iter().zip(last) {
        assert!(first.abs_diff(last) < first / 50, "a round is as much work at the end as at the beginning: {first}, then {last} in 1,000");
    }
    let kept = rig.system.history("x", 1_000).expect("it has a history");
    assert_eq!(kept.len(), 100, "as many as were declared");
    let statistics = rig.system.statistics();
    assert!(statistics.sources.values().all(|source| source.steps == 0), "{statistics:?}");
}
