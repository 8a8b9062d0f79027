// SPDX-License-Identifier: Apache-2.0
//! One source as all threads see it, and what the sources of a host share.
use crate::bell::Bell;
use crate::containment::Containment;
use crate::counters::{Counters, Statistics};
use crate::event::Listener;
use crate::script::Mailbox;
use crate::source::{Requests, SourceId, SourceKind, SourceSpec};
use crate::tape::Tape;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

/// State shared by all kernels of a host.
#[derive(Default)]
pub struct HostState {
    /// Order of the events of the host.
    pub serials: AtomicU64,
    /// Bell of the supervisor's sleep.
    pub supervisor: Bell,
    /// Time for which a timer may stand still, if one was set; 0: none was.
    standstill_ns: AtomicI64,
    /// Handlers of faults that somebody had replaced, in words, until the supervisor takes them.
    replaced: Mutex<Option<String>>,
    is_replaced: AtomicBool,
}

/// Default time for which a timer may stand still.
const STANDSTILL_NS: i64 = 2_000_000_000;

impl HostState {
    /// Returns for how long a timer may stand still before the outputs of its devices count as unattended.
    pub fn standstill_ns(&self) -> i64 {
        match self.standstill_ns.load(Ordering::Relaxed) {
            0 => STANDSTILL_NS,
            said => said,
        }
    }

    /// Sets that bound. Of several, the longest holds.
    pub fn allow_standstill(&self, bound_ns: i64) {
        self.standstill_ns.fetch_max(bound_ns, Ordering::Relaxed);
    }

    /// Keeps for the supervisor that handlers of faults had been replaced. Not for the real-time path.
    pub fn tell_replaced(&self, text: String) {
        *self.replaced.lock().expect("nobody panics with the lock held") = Some(text);
        self.is_replaced.store(true, Ordering::Release);
        self.supervisor.ring();
    }

    /// Takes what [`HostState::tell_replaced`] has kept.
    pub fn take_replaced(&self) -> Option<String> {
        if !self.is_replaced.swap(false, Ordering::AcqRel) {
            return None;
        }
        self.replaced.lock().expect("nobody panics with the lock held").take()
    }
}

/// One source as all threads see it.
pub struct Source {
    pub id: SourceId,
    pub spec: SourceSpec,
    /// Scripts on their way to it.
    pub mailbox: Mailbox,
    /// Scripts that were carried out.
    pub done: Mailbox,
    /// Requests by which others raise it.
    pub requests: Arc<Requests>,
    pub closing: AtomicBool,
    /// True if it ends, and an heir has its devices.
    pub leaving: AtomicBool,
    /// A block was ended in code of a library that may hold a lock: its thread runs no step again, and does not end.
    pub is_lost: AtomicBool,
    /// A block keeps the budget's signal from its thread.
    pub is_deaf: AtomicBool,
    /// The system has ended its thread.
    pub is_gone: AtomicBool,
    /// Either is told, once.
    pub is_told: AtomicBool,
    /// Set by `Host::restart`, taken by the kernel.
    pub restarting: AtomicBool,
    pub containment: Containment,
    /// End of the probe's visits to its blocks, on CLOCK_MONOTONIC.
    pub probe_until_ns: AtomicI64,
    pub counters: Counters,
    pub rights_missing: Mutex<Vec<String>>,
    /// Where a record is made of it, or it does again what is recorded.
    pub tape: Option<Arc<dyn Tape>>,
    listener: Mutex<Listener>,
}

impl Source {
    pub fn new(id: SourceId, spec: SourceSpec, listener: Listener, containment: Containment, tape: Option<Arc<dyn Tape>>) -> Source {
        Source {
            id,
            spec,
            mailbox: Mailbox::default(),
            done: Mailbox::default(),
            requests: Arc::default(),
            closing: AtomicBool::new(false),
            leaving: AtomicBool::new(false),
            is_lost: AtomicBool::new(false),
            is_deaf: AtomicBool::new(false),
            is_gone: AtomicBool::new(false),
            is_told: AtomicBool::new(false),
            restarting: AtomicBool::new(false),
            containment,
            probe_until_ns: AtomicI64::new(i64::MIN),
            counters: Counters::default(),
            rights_missing: Mutex::new(Vec::new()),
            tape,
            listener: Mutex::new(listener),
        }
    }

    /// Returns true if nobody may wait for its thread to end.
    pub fn is_beyond_reach(&self) -> bool {
        self.is_lost.load(Ordering::Acquire) || self.is_deaf.load(Ordering::Acquire) || self.is_gone.load(Ordering::Acquire)
    }

    /// Counts a request at `now_ns`. Real-time safe; wake it afterwards.
    pub fn request(&self, now_ns: i64) {
        self.requests.request(now_ns);
    }

    /// Returns the bell on which its thread sleeps.
    pub fn bell(&self) -> &Bell {
        &self.requests.bell
    }

    /// Returns the supervisor's end. No kernel takes it.
    pub fn listener(&self) -> MutexGuard<'_, Listener> {
        self.listener.lock().expect("nobody panics with the lock held")
    }

    /// Returns the period of a timer.
    pub fn period_ns(&self) -> Option<i64> {
        match self.spec.kind {
            SourceKind::Timer { period_ns } => Some(period_ns as i64),
            SourceKind::Software => None,
        }
    }

    /// Returns its statistics.
    pub fn statistics(&self) -> Statistics {
        Statistics { rights_missing: self.rights_missing.lock().expect("nobody panics with the lock held").clone(), ..self.counters.read() }
    }
}
