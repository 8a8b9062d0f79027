// SPDX-License-Identifier: Apache-2.0
//! Lock of the core with precedence: a thread that stops something waits only for the current holder, never for others in the queue.
//!
//! | thread | holds while it has the core | waits for |
//! |---|---|---|
//! | one that stops something, the supervisor's thread | the core | the holder of the core, others that stop |
//! | every other | its turn and the core | its turn, then the same |
//!
//! Only one thread without precedence has the turn at a time, so at most one of them waits for the core itself, and the holder of `next`
//! acquires it next. A plain mutex would go to the thread that arrives at the right moment, typically one that reads in a loop.
use std::cell::Cell;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

thread_local! {
    /// True if this thread is about to stop something.
    static STOPS: Cell<bool> = const { Cell::new(false) };
}

/// Executes `act`, which stops something, with precedence over all others.
pub fn first<T>(act: impl FnOnce() -> T) -> T {
    struct Before(bool);
    impl Drop for Before {
        fn drop(&mut self) {
            STOPS.set(self.0);
        }
    }
    let _before = Before(STOPS.replace(true));
    act()
}

/// The core behind its lock.
pub(crate) struct Precedence<T> {
    core: Mutex<T>,
    next: Mutex<()>,
    turn: Mutex<()>,
}

/// The locked core. The lock is released before the turn.
pub(crate) struct LockedCore<'a, T> {
    core: MutexGuard<'a, T>,
    _turn: Option<MutexGuard<'a, ()>>,
}

impl<T> Precedence<T> {
    pub fn new(core: T) -> Precedence<T> {
        Precedence { core: Mutex::new(core), next: Mutex::default(), turn: Mutex::default() }
    }

    pub fn lock(&self) -> LockedCore<'_, T> {
        self.sound().expect("nobody panics while the supervisor works")
    }

    /// Locks the core; returns `None` if a thread panicked while holding the lock.
    pub fn sound(&self) -> Option<LockedCore<'_, T>> {
        // Neither of these guards data that a panic could leave inconsistent.
        let turn = (!STOPS.get()).then(|| self.turn.lock().unwrap_or_else(PoisonError::into_inner));
        let _next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        let core = self.core.lock().ok()?;
        Some(LockedCore { core, _turn: turn })
    }

    /// Returns true if a thread panicked while holding the core.
    pub fn is_poisoned(&self) -> bool {
        self.core.is_poisoned()
    }
}

impl<T> Deref for LockedCore<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.core
    }
}

impl<T> DerefMut for LockedCore<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.core
    }
}

/// Change counter on which threads can wait, protected by the lock of the core. A waiting thread does not hold the core.
#[derive(Default)]
pub(crate) struct Changes {
    count: AtomicU64,
    /// Number of waiting threads; if it is 0, `tell` need not make the system call.
    waiting: AtomicUsize,
    asleep: Mutex<()>,
    told: Condvar,
}

impl Changes {
    /// Returns the number of changes so far.
    pub fn count(&self) -> u64 {
        self.count.load(Ordering::Acquire)
    }

    /// Signals a change. The core must be locked.
    pub fn tell(&self) {
        self.count.fetch_add(1, Ordering::Release);
        if self.waiting.load(Ordering::Acquire) > 0 {
            drop(self.asleep.lock().unwrap_or_else(PoisonError::into_inner));
            self.told.notify_all();
        }
    }

    /// Releases the core and waits for a change, for at most `timeout`.
    pub fn wait<T>(&self, core: LockedCore<'_, T>, timeout: Duration) {
        let seen = self.count.load(Ordering::Acquire);
        self.waiting.fetch_add(1, Ordering::AcqRel);
        drop(core);
        let asleep = self.asleep.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |_: &mut ()| self.count.load(Ordering::Acquire) == seen;
        drop(self.told.wait_timeout_while(asleep, timeout, is_same).unwrap_or_else(PoisonError::into_inner));
        self.waiting.fetch_sub(1, Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn what_stops_has_the_core_next_however_many_want_it() {
        let core = Precedence::new(Vec::new());
        let held = core.lock();
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| core.lock().push("reader"));
            }
            scope.spawn(|| first(|| core.lock().push("stop")));
            // A thread that waits for the core holds `next`.
            while core.next.try_lock().is_ok() {
                std::thread::yield_now();
            }
            drop(held);
        });
        assert_eq!(core.lock().first(), Some(&"stop"));
        assert_eq!(core.lock().len(), 9);
    }

    #[test]
    fn who_waits_for_a_change_has_let_go_of_the_core_and_misses_none() {
        let (core, changes, is_there) = (Precedence::new(0), Changes::default(), AtomicBool::new(false));
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let held = core.lock();
                is_there.store(true, Ordering::Release);
                changes.wait(held, Duration::from_secs(3600));
                assert_eq!(*core.lock(), 1);
            });
            while !is_there.load(Ordering::Acquire) {
                std::thread::yield_now();
            }
            *core.lock() += 1;
            changes.tell();
        });
    }
}
