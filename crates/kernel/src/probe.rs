// SPDX-License-Identifier: Apache-2.0
//! Block times: a probe that visits one block a firing. Looking costs three clock reads a firing instead of two a step, and where
//! nobody looks one comparison a firing.
use crate::counters::add;
use std::sync::atomic::{AtomicU64, Ordering};

/// Durations of those invocations of a block that the probe visited: ns of real time, under any clock, without what reading the
/// clock takes. What preempted an invocation counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct BlockTimes {
    /// Invocations that were visited since the block was installed.
    pub samples: u64,
    /// The latest of them.
    pub last_ns: u64,
    /// The longest.
    pub max_ns: u64,
    /// Sum of all.
    pub sum_ns: u64,
    /// Its invocations since it was started, at the latest visit: two looks tell its rate.
    pub number: u64,
}

/// Times of one block; written by the kernel of its source alone, with plain stores.
#[derive(Default)]
pub(crate) struct Times {
    samples: AtomicU64,
    last_ns: AtomicU64,
    max_ns: AtomicU64,
    sum_ns: AtomicU64,
    number: AtomicU64,
}

impl Times {
    pub(crate) fn add(&self, ns: u64, number: u64) {
        self.number.store(number, Ordering::Relaxed);
        self.last_ns.store(ns, Ordering::Relaxed);
        if ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.store(ns, Ordering::Relaxed);
        }
        add(&self.sum_ns, ns);
        add(&self.samples, 1);
    }

    pub(crate) fn read(&self) -> BlockTimes {
        let load = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        BlockTimes {
            samples: load(&self.samples),
            last_ns: load(&self.last_ns),
            max_ns: load(&self.max_ns),
            sum_ns: load(&self.sum_ns),
            number: load(&self.number),
        }
    }
}
