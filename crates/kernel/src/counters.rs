// SPDX-License-Identifier: Apache-2.0
//! Counters of a source.
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Counters and histograms of one source, readable at any time.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Statistics {
    /// Firings, except those of `execute`.
    pub firings: u64,
    /// Releases that were skipped because the previous firing had not finished.
    pub overruns: u64,
    /// Ratio values that were missing when their reader needed them.
    pub late: u64,
    /// Invocations that faulted.
    pub faults: u64,
    /// Start latency of firings relative to their release: last, maximum, and counts in bins of powers of two from 2^0 ns to 2^31 ns.
    pub jitter_last_ns: u64,
    /// Maximum start latency.
    pub jitter_max_ns: u64,
    /// Bin b counts values from 2^b to 2^(b+1) ns; the first also includes 0, the last also includes larger values.
    pub jitter_bins: [u64; 32],
    /// Duration of the last firing.
    pub duration_last_ns: u64,
    /// Maximum duration.
    pub duration_max_ns: u64,
    /// Counts of durations, in the same bins as `jitter_bins`.
    pub duration_bins: [u64; 32],
    /// Sum over all firings; yields the share of time in which the source is busy.
    pub duration_sum_ns: u64,
    /// Conditions and other events that were lost because their queue was full.
    pub lost: u64,
    /// True if a fault has stopped the source.
    pub stopped: bool,
    /// Privileges that were requested but not granted (priority, memory lock, core), as messages; empty if all were granted.
    pub rights_missing: Vec<String>,
}

/// Counters written only by the source's own kernel, with plain stores.
#[derive(Default)]
pub struct Counters {
    pub(crate) firings: AtomicU64,
    pub overruns: AtomicU64,
    pub(crate) late: AtomicU64,
    pub(crate) faults: AtomicU64,
    pub(crate) lost: AtomicU64,
    pub stopped: AtomicBool,
    pub jitter: Histogram,
    pub duration: Histogram,
}

impl Counters {
    /// Returns the current values.
    pub(crate) fn read(&self) -> Statistics {
        let load = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Statistics {
            firings: load(&self.firings),
            overruns: load(&self.overruns),
            late: load(&self.late),
            faults: load(&self.faults),
            lost: load(&self.lost),
            jitter_last_ns: load(&self.jitter.last_ns),
            jitter_max_ns: load(&self.jitter.max_ns),
            jitter_bins: std::array::from_fn(|bin| load(&self.jitter.bins[bin])),
            duration_last_ns: load(&self.duration.last_ns),
            duration_max_ns: load(&self.duration.max_ns),
            duration_bins: std::array::from_fn(|bin| load(&self.duration.bins[bin])),
            duration_sum_ns: load(&self.duration.sum_ns),
            stopped: self.stopped.load(Ordering::Acquire),
            rights_missing: Vec::new(),
        }
    }
}

/// Last, maximum, sum, and counts in bins of powers of two.
#[derive(Default)]
pub struct Histogram {
    last_ns: AtomicU64,
    max_ns: AtomicU64,
    sum_ns: AtomicU64,
    bins: [AtomicU64; 32],
}

impl Histogram {
    #[inline]
    pub fn add(&self, ns: i64) {
        let ns = ns.max(0) as u64;
        self.last_ns.store(ns, Ordering::Relaxed);
        if ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.store(ns, Ordering::Relaxed);
        }
        add(&self.sum_ns, ns);
        add(&self.bins[(ns | 1).ilog2().min(31) as usize], 1);
    }
}

/// Adds to a counter that only this thread writes, without an atomic read-modify-write.
#[inline]
pub fn add(counter: &AtomicU64, n: u64) {
    counter.store(counter.load(Ordering::Relaxed) + n, Ordering::Relaxed);
}
