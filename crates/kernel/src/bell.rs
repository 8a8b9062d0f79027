// SPDX-License-Identifier: Apache-2.0
//! Waiting on a word, and waking who waits on it: what a source sleeps on between firings.
use std::sync::atomic::{AtomicU32, Ordering};

/// A bell: a word that counts what happened, and whether somebody sleeps until it changes. One sleeper, any number of ringers.
#[derive(Default)]
pub struct Bell {
    rings: AtomicU32,
    asleep: AtomicU32,
}

impl Bell {
    /// What has happened so far; read it before looking for work, then `sleep` on it.
    pub fn rings(&self) -> u32 {
        self.rings.load(Ordering::SeqCst)
    }

    /// Counts, without waking. Real-time safe.
    pub(crate) fn mark(&self) {
        self.rings.fetch_add(1, Ordering::SeqCst);
    }

    /// Wakes the sleeper if there is one: a system call only then.
    pub fn wake(&self) {
        if self.asleep.load(Ordering::SeqCst) != 0 {
            // SAFETY: a wake on a word of ours.
            unsafe { libc::syscall(libc::SYS_futex, self.rings.as_ptr(), libc::FUTEX_WAKE | libc::FUTEX_PRIVATE_FLAG, i32::MAX) };
        }
    }

    /// Counts and wakes.
    pub fn ring(&self) {
        self.mark();
        self.wake();
    }

    /// Sleeps until something has happened since `seen`, or until `until_ns` of CLOCK_MONOTONIC. May return early.
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
