// SPDX-License-Identifier: Apache-2.0
//! Interrupt sources.
use crate::event::Listener;
use crate::futex::Bell;
use crate::guard::Guard;
use crate::script::Mailbox;
use crate::tape::Tape;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

/// Index of a source in its host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct SourceId(pub u32);

/// What requests its firings.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum SourceKind {
    /// Releases at epoch + k · period; the epoch is the host's, the same for all of its timers.
    Timer { period_ns: u64 },
    /// Fires when it is requested: by another source's connection, by a device, by the PS (`Host::request`). A trigger is one.
    /// Each request is one firing.
    Software,
}

/// What a source is.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct SourceSpec {
    /// Its processor.
    pub rtp: u16,
    /// For people.
    pub name: String,
    /// What requests its firings.
    pub kind: SourceKind,
    /// 1 (lowest) to 98; taken as SCHED_FIFO priority where the rights are given.
    pub priority: u8,
    /// Core to pin its thread to.
    pub core: Option<usize>,
    /// What one firing costs under the virtual clock, ns (0: nothing): sources of higher priority then preempt it at step
    /// boundaries and inside publications, chosen by the host's seed.
    pub virtual_cost_ns: u64,
}

/// Counters and histograms of one source, readable at any time.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Statistics {
    /// Firings, without those of `execute`.
    pub firings: u64,
    /// Releases that were skipped because the firing before was not over.
    pub overruns: u64,
    /// Ratio values that were absent when their reader asked for them.
    pub late: u64,
    /// Invocations that faulted.
    pub faults: u64,
    /// Lateness of the start of firings behind their release: last, greatest, and counts in bins of powers of two from 2^0 ns to 2^31 ns.
    pub jitter_last_ns: u64,
    /// Greatest lateness.
    pub jitter_max_ns: u64,
    /// Bin b counts values from 2^b to 2^(b+1) ns; the first also 0, the last also more.
    pub jitter_bins: [u64; 32],
    /// Length of a firing, the same way.
    pub duration_last_ns: u64,
    /// Greatest length.
    pub duration_max_ns: u64,
    /// As `jitter_bins`.
    pub duration_bins: [u64; 32],
    /// Of all firings together: what share of the time it works.
    pub duration_sum_ns: u64,
    /// Conditions and other events that found no place and were lost.
    pub lost: u64,
    /// A fault stopped it.
    pub stopped: bool,
    /// What was asked for and not given (priority, memory lock, core), in words; empty if all was.
    pub rights_missing: Vec<String>,
}

/// One source as all threads see it.
pub(crate) struct Source {
    pub(crate) id: SourceId,
    pub(crate) spec: SourceSpec,
    /// Scripts on their way to it.
    pub(crate) mailbox: Mailbox,
    /// Scripts that were carried out.
    pub(crate) done: Mailbox,
    /// Requests that have not had their firing.
    pub(crate) requests: AtomicU64,
    /// Virtual clock: when the first of them came.
    pub(crate) requested_ns: AtomicU64,
    pub(crate) bell: Bell,
    pub(crate) closing: AtomicBool,
    /// It ends, and an heir has its devices.
    pub(crate) leaving: AtomicBool,
    /// Set by `Host::restart`, taken by the kernel.
    pub(crate) restarting: AtomicBool,
    pub(crate) guard: Guard,
    /// Until when the probe visits its blocks, on CLOCK_MONOTONIC.
    pub(crate) probe_until_ns: AtomicI64,
    pub(crate) counters: Counters,
    pub(crate) rights_missing: Mutex<Vec<String>>,
    /// Where a record is made of it, or it does again what is recorded.
    pub(crate) tape: Option<Arc<Tape>>,
    listener: Mutex<Listener>,
}

impl Source {
    pub(crate) fn new(id: SourceId, spec: SourceSpec, listener: Listener, guard: Guard, tape: Option<Arc<Tape>>) -> Source {
        Source {
            id,
            spec,
            mailbox: Mailbox::default(),
            done: Mailbox::default(),
            requests: AtomicU64::new(0),
            requested_ns: AtomicU64::new(0),
            bell: Bell::default(),
            closing: AtomicBool::new(false),
            leaving: AtomicBool::new(false),
            restarting: AtomicBool::new(false),
            guard,
            probe_until_ns: AtomicI64::new(i64::MIN),
            counters: Counters::default(),
            rights_missing: Mutex::new(Vec::new()),
            tape,
            listener: Mutex::new(listener),
        }
    }

    /// Counts a request at `now_ns`. Real-time safe; wake it afterwards.
    pub(crate) fn request(&self, now_ns: i64) {
        if self.requests.load(Ordering::SeqCst) == 0 {
            self.requested_ns.store(now_ns as u64, Ordering::SeqCst);
        }
        self.requests.fetch_add(1, Ordering::SeqCst);
        self.bell.mark();
    }

    /// The supervisor's end. Never taken by a kernel.
    pub(crate) fn listener(&self) -> MutexGuard<'_, Listener> {
        self.listener.lock().expect("nobody panics with the lock held")
    }

    /// The period of a timer.
    pub(crate) fn period_ns(&self) -> Option<i64> {
        match self.spec.kind {
            SourceKind::Timer { period_ns } => Some(period_ns as i64),
            SourceKind::Software => None,
        }
    }

    pub(crate) fn statistics(&self) -> Statistics {
        let counters = &self.counters;
        let load = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Statistics {
            firings: load(&counters.firings),
            overruns: load(&counters.overruns),
            late: load(&counters.late),
            faults: load(&counters.faults),
            lost: load(&counters.lost),
            jitter_last_ns: load(&counters.jitter.last_ns),
            jitter_max_ns: load(&counters.jitter.max_ns),
            jitter_bins: std::array::from_fn(|bin| load(&counters.jitter.bins[bin])),
            duration_last_ns: load(&counters.duration.last_ns),
            duration_max_ns: load(&counters.duration.max_ns),
            duration_bins: std::array::from_fn(|bin| load(&counters.duration.bins[bin])),
            duration_sum_ns: load(&counters.duration.sum_ns),
            stopped: counters.stopped.load(Ordering::Acquire),
            rights_missing: self.rights_missing.lock().expect("nobody panics with the lock held").clone(),
        }
    }
}

/// Written by the source's own kernel alone, with plain stores.
#[derive(Default)]
pub(crate) struct Counters {
    pub(crate) firings: AtomicU64,
    pub(crate) overruns: AtomicU64,
    pub(crate) late: AtomicU64,
    pub(crate) faults: AtomicU64,
    pub(crate) lost: AtomicU64,
    pub(crate) stopped: AtomicBool,
    pub(crate) jitter: Histogram,
    pub(crate) duration: Histogram,
}

/// Last, greatest, sum, and counts in bins of powers of two.
#[derive(Default)]
pub(crate) struct Histogram {
    last_ns: AtomicU64,
    max_ns: AtomicU64,
    sum_ns: AtomicU64,
    bins: [AtomicU64; 32],
}

impl Histogram {
    #[inline]
    pub(crate) fn add(&self, ns: i64) {
        let ns = ns.max(0) as u64;
        self.last_ns.store(ns, Ordering::Relaxed);
        if ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.store(ns, Ordering::Relaxed);
        }
        add(&self.sum_ns, ns);
        add(&self.bins[(ns | 1).ilog2().min(31) as usize], 1);
    }
}

/// Adds to a counter that this thread alone writes: no atomic read-modify-write.
#[inline]
pub(crate) fn add(counter: &AtomicU64, n: u64) {
    counter.store(counter.load(Ordering::Relaxed) + n, Ordering::Relaxed);
}
