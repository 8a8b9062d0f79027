// SPDX-License-Identifier: Apache-2.0
//! A source as seen by all threads, and state shared by the sources of a host.
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
    /// Serial numbers of the host's events.
    pub serials: AtomicU64,
    /// Bell that wakes the supervisor.
    pub supervisor: Bell,
    /// Maximum time for which a timer may be suspended; 0 if not set.
    standstill_ns: AtomicI64,
    /// Description of replaced fault handlers, kept until the supervisor takes it.
    replaced: Mutex<Option<String>>,
    is_replaced: AtomicBool,
}

/// Default maximum suspension of a timer.
const STANDSTILL_NS: i64 = 2_000_000_000;

impl HostState {
    /// Returns the maximum time for which a timer may be suspended before the outputs of its devices count as unattended.
    pub fn standstill_ns(&self) -> i64 {
        match self.standstill_ns.load(Ordering::Relaxed) {
            0 => STANDSTILL_NS,
            said => said,
        }
    }

    /// Sets the maximum suspension. If set several times, the longest one applies.
    pub fn allow_standstill(&self, bound_ns: i64) {
        self.standstill_ns.fetch_max(bound_ns, Ordering::Relaxed);
    }

    /// Stores the description of replaced fault handlers for the supervisor. Not for the real-time path.
    pub fn tell_replaced(&self, text: String) {
        *self.replaced.lock().expect("nobody panics with the lock held") = Some(text);
        self.is_replaced.store(true, Ordering::Release);
        self.supervisor.ring();
    }

    /// Takes the text stored by [`HostState::tell_replaced`].
    pub fn take_replaced(&self) -> Option<String> {
        if !self.is_replaced.swap(false, Ordering::AcqRel) {
            return None;
        }
        self.replaced.lock().expect("nobody panics with the lock held").take()
    }
}

/// A source as seen by all threads.
pub struct Source {
    pub id: SourceId,
    pub spec: SourceSpec,
    /// Scripts submitted to the source.
    pub mailbox: Mailbox,
    /// Scripts that the source has carried out.
    pub done: Mailbox,
    /// Requests for firings from other threads.
    pub requests: Arc<Requests>,
    pub closing: AtomicBool,
    /// True if the source is ending and an heir takes over its devices.
    pub leaving: AtomicBool,
    /// True if a block was aborted in code of a library that may hold a lock: the source's thread runs no further step and does not exit.
    pub is_lost: AtomicBool,
    /// True if a block has blocked the budget signal in the source's thread.
    pub is_deaf: AtomicBool,
    /// True if the operating system has terminated the source's thread.
    pub is_gone: AtomicBool,
    /// True once `is_deaf` or `is_gone` has been reported.
    pub is_told: AtomicBool,
    /// Set by `Host::restart`, cleared by the kernel.
    pub restarting: AtomicBool,
    pub containment: Containment,
    /// Time at which the probe stops sampling the source's blocks, on CLOCK_MONOTONIC.
    pub probe_until_ns: AtomicI64,
    pub counters: Counters,
    pub rights_missing: Mutex<Vec<String>>,
    /// Tape, if the source is being recorded or played back.
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

    /// Returns true if the source's thread may never exit, so that no thread may wait for it.
    pub fn is_beyond_reach(&self) -> bool {
        self.is_lost.load(Ordering::Acquire) || self.is_deaf.load(Ordering::Acquire) || self.is_gone.load(Ordering::Acquire)
    }

    /// Counts a request at `now_ns`. Real-time safe; wake the source afterwards.
    pub fn request(&self, now_ns: i64) {
        self.requests.request(now_ns);
    }

    /// Returns the bell on which the source's thread sleeps.
    pub fn bell(&self) -> &Bell {
        &self.requests.bell
    }

    /// Returns the supervisor's end of the source's event queue. Never locked by a kernel.
    pub fn listener(&self) -> MutexGuard<'_, Listener> {
        self.listener.lock().expect("nobody panics with the lock held")
    }

    /// Returns the period if the source is a timer.
    pub fn period_ns(&self) -> Option<i64> {
        match self.spec.kind {
            SourceKind::Timer { period_ns } => Some(period_ns as i64),
            SourceKind::Software => None,
        }
    }

    /// Returns the source's statistics.
    pub fn statistics(&self) -> Statistics {
        Statistics { rights_missing: self.rights_missing.lock().expect("nobody panics with the lock held").clone(), ..self.counters.read() }
    }
}
