// SPDX-License-Identifier: Apache-2.0
//! Futex-like waiting and waking: sources sleep on a bell between firings, and the supervisor between events.
//!
//! | role | does | never |
//! |---|---|---|
//! | ringer (`ring`, `tell`) | counts, then checks whether a thread attends and whether the sleeper is asleep; at most one system call | waits |
//! | sleeper (`sleep`) | declares that it sleeps, then reads the count | sleeps through a `ring` |
//! | attendant (`attend`, `leave`) | declares that it has left, then reads the count | leaves a `tell` that it has not seen |
//!
//! Each role writes its own word before it reads the others' words, all sequentially consistent (SeqCst): of any two, at least one sees
//! the other.
use std::sync::atomic::{AtomicU32, Ordering};

/// Event counter, with a flag that indicates whether a thread is sleeping until the count changes. One sleeper, any number of ringers.
#[derive(Default)]
pub struct Bell {
    rings: AtomicU32,
    asleep: AtomicU32,
    /// Number of threads that watch the count on behalf of the sleeper.
    attending: AtomicU32,
    /// Set if a `tell` left the sleeper asleep and no attendant has left since.
    owed: AtomicU32,
}

impl Bell {
    /// Returns the number of rings so far. Read it before looking for work, then pass it to `sleep`.
    pub fn rings(&self) -> u32 {
        self.rings.load(Ordering::SeqCst)
    }

    /// Increments the count without waking the sleeper. Real-time safe.
    pub(crate) fn mark(&self) {
        self.rings.fetch_add(1, Ordering::SeqCst);
    }

    /// Wakes the sleeper. Makes a system call only if a thread sleeps.
    pub fn wake(&self) {
        if self.asleep.load(Ordering::SeqCst) != 0 {
            // SAFETY: a wake on a word of ours.
            unsafe { libc::syscall(libc::SYS_futex, self.rings.as_ptr(), libc::FUTEX_WAKE | libc::FUTEX_PRIVATE_FLAG, i32::MAX) };
        }
    }

    /// Increments the count and wakes the sleeper.
    pub fn ring(&self) {
        self.mark();
        self.wake();
    }

    /// Increments the count, and wakes the sleeper unless another thread is attending on its behalf. Real-time safe.
    pub fn tell(&self) {
        self.mark();
        if self.attending.load(Ordering::SeqCst) == 0 {
            self.wake();
        } else {
            self.owed.store(1, Ordering::SeqCst);
        }
    }

    /// Makes this thread watch the count on behalf of the sleeper until it calls `leave`. If this thread may be delayed, another thread
    /// must call `remind`.
    pub fn attend(&self) {
        self.attending.fetch_add(1, Ordering::SeqCst);
    }

    /// Ends `attend` for a thread that has handled all rings up to `seen`; wakes the sleeper if there have been later ones.
    pub fn leave(&self, seen: u32) {
        self.attending.fetch_sub(1, Ordering::SeqCst);
        self.owed.store(0, Ordering::SeqCst);
        if self.rings() != seen {
            self.wake();
        }
    }

    /// Returns true if a `tell` left the sleeper asleep and no attendant has left since. Real-time safe.
    pub fn is_owed(&self) -> bool {
        self.owed.load(Ordering::Relaxed) != 0
    }

    /// Wakes the sleeper even if a thread attends in its place.
    pub fn remind(&self) {
        self.owed.store(0, Ordering::SeqCst);
        self.wake();
    }

    /// Sleeps until the count differs from `seen`, or until `until_ns` of CLOCK_MONOTONIC. May return early.
    pub fn sleep(&self, seen: u32, until_ns: Option<i64>) {
        self.asleep.store(1, Ordering::SeqCst);
        if self.rings.load(Ordering::SeqCst) == seen {
            let time = until_ns.map(|ns| libc::timespec { tv_sec: ns / 1_000_000_000, tv_nsec: ns % 1_000_000_000 });
            let time = time.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
            let operation = libc::FUTEX_WAIT_BITSET | libc::FUTEX_PRIVATE_FLAG;
            // SAFETY: the word and the absolute time live through the call.
            unsafe { libc::syscall(libc::SYS_futex, self.rings.as_ptr(), operation, seen, time, 0, u32::MAX) };
        }
        self.asleep.store(0, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    /// Runs `act` while another thread sleeps on the bell, and waits until that thread is awake again.
    fn wakes(bell: &Bell, act: impl FnOnce()) {
        thread::scope(|scope| {
            scope.spawn(|| bell.sleep(bell.rings(), None));
            while bell.asleep.load(Ordering::SeqCst) == 0 {
                thread::yield_now();
            }
            act();
        });
    }

    #[test]
    fn a_thread_that_attends_owes_the_sleeper_what_it_has_not_seen() {
        let bell = Bell::default();
        bell.attend();
        bell.tell();
        assert!(bell.is_owed());
        bell.leave(bell.rings());
        assert!(!bell.is_owed(), "it has seen all");
        bell.tell();
        assert!(!bell.is_owed(), "no thread attends");
        bell.attend();
        let seen = bell.rings();
        wakes(&bell, || {
            bell.tell();
            bell.leave(seen);
        });
        assert!(!bell.is_owed());
    }

    #[test]
    fn a_reminder_wakes_the_sleeper_though_a_thread_attends() {
        let bell = Bell::default();
        bell.attend();
        bell.tell();
        wakes(&bell, || {
            // Repeated, because the sleeper may be about to enter its system call.
            while bell.asleep.load(Ordering::SeqCst) != 0 {
                bell.remind();
                thread::yield_now();
            }
        });
        assert!(!bell.is_owed());
        bell.leave(bell.rings());
    }

    #[test]
    fn nothing_is_slept_through_however_threads_attend_and_leave() {
        const TELLS: u32 = 20_000;
        let (bell, taken) = (Bell::default(), AtomicU32::new(0));
        let take = |seen: u32| taken.fetch_max(seen, Ordering::SeqCst);
        thread::scope(|scope| {
            scope.spawn(|| {
                loop {
                    let seen = bell.rings();
                    take(seen);
                    if seen == TELLS {
                        break;
                    }
                    bell.sleep(seen, None);
                }
            });
            scope.spawn(|| (0..TELLS).for_each(|_| bell.tell()));
            for _ in 0..2 {
                scope.spawn(|| {
                    while taken.load(Ordering::SeqCst) != TELLS {
                        bell.attend();
                        let seen = bell.rings();
                        if seen == TELLS {
                            // The sleeper must see it too.
                            bell.leave(seen.wrapping_sub(1));
                            break;
                        }
                        bell.leave(seen);
                    }
                });
            }
        });
        assert_eq!(bell.rings(), TELLS);
    }
}
