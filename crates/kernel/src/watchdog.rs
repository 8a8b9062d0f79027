// SPDX-License-Identifier: Apache-2.0
//! The watchdog: an ordinary thread that looks for step loops that are older than their budget.
use crate::source::Source;
use crate::{clock::monotonic_ns, rights};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, RwLock};
use std::time::Duration;

/// How often it looks: a tenth of the least default budget.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// A priority above that of every source: a runaway block at a real-time priority must not keep the watchdog from its core.
const PRIORITY: u8 = 99;

#[derive(Default)]
pub(crate) struct Watchdog {
    sources: RwLock<Vec<Arc<Source>>>,
    closing: AtomicBool,
    wait: Mutex<()>,
    closed: Condvar,
}

impl Watchdog {
    pub(crate) fn watch(&self, source: Arc<Source>) {
        self.sources.write().expect("nobody panics with the lock held").push(source);
    }

    pub(crate) fn close(&self) {
        self.closing.store(true, Ordering::Release);
        drop(self.wait.lock().expect("nobody panics with the lock held"));
        self.closed.notify_all();
    }

    /// The thread.
    pub(crate) fn run(&self) {
        rights::prioritise(PRIORITY);
        let mut waiting = self.wait.lock().expect("nobody panics with the lock held");
        while !self.closing.load(Ordering::Acquire) {
            let now_ns = monotonic_ns();
            self.sources.read().expect("nobody panics with the lock held").iter().for_each(|source| source.guard.watch(now_ns));
            waiting = self.closed.wait_timeout(waiting, LOOK_EVERY).expect("nobody panics with the lock held").0;
        }
    }
}
