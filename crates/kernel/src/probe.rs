// SPDX-License-Identifier: Apache-2.0
//! Block times: a probe that samples one block per firing. It costs three clock reads per firing instead of two per step, and only one
//! comparison per firing while the times are not being read.
use crate::counters::add;
use std::sync::atomic::{AtomicU64, Ordering};

/// Durations of the invocations of a block that the probe sampled, in ns of real time under any clock, less the cost of reading the
/// clock. Includes the time for which an invocation was preempted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct BlockTimes {
    /// Number of invocations sampled since the block was installed.
    pub samples: u64,
    /// Duration of the latest sample.
    pub last_ns: u64,
    /// Maximum duration.
    pub max_ns: u64,
    /// Sum of all durations.
    pub sum_ns: u64,
    /// Number of the block's invocations since the block was started, as of the latest sample; two readings give its rate.
    pub number: u64,
}

/// Times of one block; written only by the kernel of its source, with plain stores.
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
