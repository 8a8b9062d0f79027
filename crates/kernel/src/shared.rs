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

/// What all kernels of a host share.
#[derive(Default)]
pub struct Shared {
    /// Order of the events of the host.
    pub serials: AtomicU64,
    /// What the supervisor sleeps on.
    pub supervisor: Bell,
}

/// One source as all threads see it.
pub struct Source {
    pub id: SourceId,
    pub spec: SourceSpec,
    /// Scripts on their way to it.
    pub mailbox: Mailbox,
    /// Scripts that were carried out.
    pub done: Mailbox,
    /// What others raise it by.
    pub requests: Arc<Requests>,
    pub closing: AtomicBool,
    /// It ends, and an heir has its devices.
    pub leaving: AtomicBool,
    /// A block was ended in code of a library that may hold a lock: its thread runs no step again, and does not end.
    pub is_lost: AtomicBool,
    /// A block keeps the budget's signal from its thread. Told once.
    pub is_deaf: AtomicBool,
    pub is_told_deaf: AtomicBool,
    /// Set by `Host::restart`, taken by the kernel.
    pub restarting: AtomicBool,
    pub containment: Containment,
    /// Until when the probe visits its blocks, on CLOCK_MONOTONIC.
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
            is_told_deaf: AtomicBool::new(false),
            restarting: AtomicBool::new(false),
            containment,
            probe_until_ns: AtomicI64::new(i64::MIN),
            counters: Counters::default(),
            rights_missing: Mutex::new(Vec::new()),
            tape,
            listener: Mutex::new(listener),
        }
    }

    /// True where nobody may wait for its thread to end.
    pub fn is_beyond_reach(&self) -> bool {
        self.is_lost.load(Ordering::Acquire) || self.is_deaf.load(Ordering::Acquire)
    }

    /// Counts a request at `now_ns`. Real-time safe; wake it afterwards.
    pub fn request(&self, now_ns: i64) {
        self.requests.request(now_ns);
    }

    /// What its thread sleeps on.
    pub fn bell(&self) -> &Bell {
        &self.requests.bell
    }

    /// The supervisor's end. Never taken by a kernel.
    pub fn listener(&self) -> MutexGuard<'_, Listener> {
        self.listener.lock().expect("nobody panics with the lock held")
    }

    /// The period of a timer.
    pub fn period_ns(&self) -> Option<i64> {
        match self.spec.kind {
            SourceKind::Timer { period_ns } => Some(period_ns as i64),
            SourceKind::Software => None,
        }
    }

    /// What it has counted.
    pub fn statistics(&self) -> Statistics {
        Statistics { rights_missing: self.rights_missing.lock().expect("nobody panics with the lock held").clone(), ..self.counters.read() }
    }
}
