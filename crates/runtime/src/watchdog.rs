// SPDX-License-Identifier: Apache-2.0
//! The watchdog: an ordinary thread that detects step loops that exceed their budget.
use crate::waiting::waits_for_a_core;
use kernel::shared::HostState;
use kernel::shared::Source;
use kernel::{clock::monotonic_ns, containment};
use scheduling::Children;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, RwLock};
use std::time::Duration;

/// Poll period: a tenth of the minimum default budget.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// Lateness of a poll, ns, above which the watchdog counts as having been held up itself.
const STOOD_STILL_NS: i64 = 50_000_000;

/// Number of polls between two checks of the fault handlers if no check is requested: one second.
const HANDLERS_EVERY: u32 = 100;

/// Priority above every source, because a runaway block at a real-time priority must not keep the watchdog from its core.
const PRIORITY: u8 = 99;

pub(crate) struct Watchdog {
    /// State of the host whose supervisor the watchdog wakes.
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

    /// Checks the thread of a source. A thread that receives no signals cannot be aborted, and a thread that has exited cannot make its
    /// devices safe. In these cases, a process that was started only to run processors exits, and its guard makes its outputs safe.
    fn look(&self, source: &Source, now_ns: i64, late_ns: i64) {
        source.containment.forgive(late_ns, now_ns);
        // In this order, because a thread that was asked to close may have exited.
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

    /// Runs the watchdog thread.
    pub(crate) fn run(&self) {
        let _granted = scheduling::prioritise(PRIORITY, Children::Ordinary);
        let (mut looks, mut looked_ns) = (0, monotonic_ns());
        let mut waiting = self.wait.lock().expect("nobody panics with the lock held");
        while !self.closing.load(Ordering::Acquire) {
            let now_ns = monotonic_ns();
            // During a delay beyond a few polls the blocks stood still too: it does not count towards their budgets.
            let late_ns = (now_ns - looked_ns - STOOD_STILL_NS).max(0);
            looked_ns = now_ns;
            self.sources.read().expect("nobody panics with the lock held").iter().for_each(|source| self.look(source, now_ns, late_ns));
            // A block may replace a handler at any time.
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
