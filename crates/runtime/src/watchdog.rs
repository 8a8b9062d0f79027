// SPDX-License-Identifier: Apache-2.0
//! The watchdog: an ordinary thread that looks for step loops that are older than their budget.
use crate::rights;
use crate::waiting::waits_for_a_core;
use kernel::shared::HostState;
use kernel::shared::Source;
use kernel::{clock::monotonic_ns, containment};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, RwLock};
use std::time::Duration;

/// Period of its looks: a tenth of the minimum default budget.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// A look that is so late was held up itself, ns.
const STOOD_STILL_NS: i64 = 50_000_000;

/// Looks between two looks at the handlers of faults, where nothing has happened: a second.
const HANDLERS_EVERY: u32 = 100;

/// A priority above that of every source: a runaway block at a real-time priority must not keep the watchdog from its core.
const PRIORITY: u8 = 99;

pub(crate) struct Watchdog {
    /// The host whose supervisor it wakes.
    shared: Arc<HostState>,
    sources: RwLock<Vec<Arc<Source>>>,
    closing: AtomicBool,
    wait: Mutex<()>,
    closed: Condvar,
}

impl Watchdog {
    pub(crate) fn new(shared: Arc<HostState>) -> Watchdog {
        Watchdog { shared, sources: RwLock::default(), closing: AtomicBool::new(false), wait: Mutex::default(), closed: Condvar::new() }
    }

    /// Looks at a source: a thread that takes no signal cannot be ended, and one that is gone makes nothing safe. A process that was started for its
    /// processors ends
    /// with it, and its guard makes its outputs safe.
    fn look(&self, source: &Source, now_ns: i64, late_ns: i64) {
        source.containment.forgive(late_ns, now_ns);
        // In this order: who is told to close may be gone.
        if !source.is_gone.load(Ordering::Relaxed) && source.containment.is_gone() && !source.closing.load(Ordering::Acquire) {
            if containment::is_retiring() {
                containment::end_process();
            }
            source.is_gone.store(true, Ordering::Release);
            self.shared.supervisor.ring();
            return;
        }
        if source.containment.watch(now_ns, waits_for_a_core) && !source.is_deaf.swap(true, Ordering::AcqRel) {
            if containment::is_retiring() {
                containment::end_process();
            }
            source.containment.demote();
            self.shared.supervisor.ring();
        }
    }

    pub(crate) fn watch(&self, source: Arc<Source>) {
        self.sources.write().expect("nobody panics with the lock held").push(source);
    }

    pub(crate) fn close(&self) {
        self.closing.store(true, Ordering::Release);
        drop(self.wait.lock().expect("nobody panics with the lock held"));
        self.closed.notify_all();
    }

    /// Runs the thread.
    pub(crate) fn run(&self) {
        rights::prioritise(PRIORITY);
        let (mut looks, mut looked_ns) = (0, monotonic_ns());
        let mut waiting = self.wait.lock().expect("nobody panics with the lock held");
        while !self.closing.load(Ordering::Acquire) {
            let now_ns = monotonic_ns();
            // In the time beyond a few looks the blocks stood still too: their budgets do not run meanwhile.
            let late_ns = (now_ns - looked_ns - STOOD_STILL_NS).max(0);
            looked_ns = now_ns;
            self.sources.read().expect("nobody panics with the lock held").iter().for_each(|source| self.look(source, now_ns, late_ns));
            // A block may replace one at any time.
            looks = (looks + 1) % HANDLERS_EVERY;
            if (containment::is_look_due() || looks == 0)
                && let Some(text) = containment::restore_handlers()
            {
                self.shared.tell_replaced(text);
            }
            waiting = self.closed.wait_timeout(waiting, LOOK_EVERY).expect("nobody panics with the lock held").0;
        }
    }
}
