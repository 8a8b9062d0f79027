// SPDX-License-Identifier: Apache-2.0
//! Verb instances come and go, and leave nothing: bytes that live are counted by the allocator of this test.
mod common;
use common::*;
use serde_json::json;
use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::sync::atomic::{AtomicIsize, Ordering};

struct Counting;

static LIVE: AtomicIsize = AtomicIsize::new(0);

// SAFETY: everything is done by the system's allocator; the count is beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE.fetch_add(layout.size() as isize, Ordering::Relaxed);
        // SAFETY: as for the caller.
        unsafe { Heap.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size() as isize, Ordering::Relaxed);
        // SAFETY: as for the caller.
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

#[test]
fn ten_thousand_instances_leave_nothing() {
    let rig = Rig::new(Link::Memory);
    rig.svvs(&["x", "y"]);
    rig.define(verb(
        "v",
        &[("count", "t.count"), ("probe", "t.probe"), ("watch", "t.watch")],
        json!({"instantiation_parameters": {"a": ["count.y", "probe.u", "watch.u"], "b": ["watch.y"]}, "cells": {"t": ["count.total"], "p": ["probe.y"]},
               "input_parameters": {"limit": {"targets": ["probe.limit"], "default": 2.0}},
               "output_values": {"y": "probe.y"}, "conditions": {"above": {"on": ["probe.above"]}, "halted": {"returns": ["y"]}},
               "initial": "start", "transitions": tau(&["start, above -> start"]),
               "command_lists": lists(&[("start", &["*count", "+count 1ms", "+probe", "+watch 4ms"])])}),
    ));
    // The log and the tables of names come to their full size first.
    for at in 0..4_000 {
        round(&rig, at);
    }
    let before = LIVE.load(Ordering::Relaxed);
    for at in 0..10_000 {
        round(&rig, at);
    }
    let grown = LIVE.load(Ordering::Relaxed) - before;
    assert!(grown.abs() < 64 * 1024, "{grown} bytes more after 10,000 instances");
    let statistics = rig.system.statistics_json();
    assert!(statistics["sources"].as_object().unwrap().values().all(|source| source["steps"] == 0), "{statistics}");
}
