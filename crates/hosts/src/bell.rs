// SPDX-License-Identifier: Apache-2.0
//! The bell with which real-time ends wake the bridge.
//!
//! | | real-time end | bridge |
//! |---|---|---|
//! | may block the other | never | never |
//! | steps | three atomic operations; a wake-up (one system call that does not wait) if the bridge sleeps | one swap for each 64 ends |
//! | retries | none | none |
//! | if the other is stopped or killed anywhere | continues | continues: it wakes by itself after a tick |
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

/// Maximum number of ends that share a bell in one process.
pub(crate) const SLOTS: usize = 4096;
const WORDS: usize = SLOTS / 64;
const _: () = assert!(WORDS == 64, "one word says which words have news");

pub(crate) struct Bell {
    rung: Box<[AtomicU64; WORDS]>,
    /// Bit mask of the words of `rung` that have new entries.
    news: AtomicU64,
    state: AtomicU32,
}

const QUIET: u32 = 0;
const RUNG: u32 = 1;
const SLEEPS: u32 = 2;

impl Bell {
    pub(crate) fn new() -> Self {
        Bell { rung: Box::new([const { AtomicU64::new(0) }; WORDS]), news: AtomicU64::new(0), state: AtomicU32::new(QUIET) }
    }

    /// Rings the bell for the end at `slot`. Real-time safe.
    #[inline]
    pub(crate) fn ring(&self, slot: usize) {
        self.rung[slot / 64].fetch_or(1 << (slot % 64), Ordering::Release);
        self.news.fetch_or(1 << (slot / 64), Ordering::Release);
        if self.state.swap(RUNG, Ordering::AcqRel) == SLEEPS {
            futex_wake(&self.state);
        }
    }

    /// Sleeps until the bell rings, for at most `limit`. Called only by the bridge.
    pub(crate) fn wait(&self, limit: Duration) {
        if self.state.compare_exchange(QUIET, SLEEPS, Ordering::AcqRel, Ordering::Acquire).is_ok() {
            futex_wait(&self.state, SLEEPS, limit);
        }
        // This is a swap, not a store: it acquires the ring that it takes back, and with it the bit set before that.
        self.state.swap(QUIET, Ordering::AcqRel);
    }

    /// Takes the slots that rang since the last call. Call it after [`wait`](Self::wait); called only by the bridge.
    pub(crate) fn take(&self, mut each: impl FnMut(usize)) {
        let mut news = self.news.swap(0, Ordering::AcqRel);
        while news != 0 {
            let word = news.trailing_zeros() as usize;
            news &= news - 1;
            let mut rung = self.rung[word].swap(0, Ordering::AcqRel);
            while rung != 0 {
                each(word * 64 + rung.trailing_zeros() as usize);
                rung &= rung - 1;
            }
        }
    }
}

fn futex_wait(word: &AtomicU32, seen: u32, limit: Duration) {
    let limit = libc::timespec { tv_sec: limit.as_secs() as libc::time_t, tv_nsec: libc::c_long::from(limit.subsec_nanos()) };
    // SAFETY: the word and the time live through the call; the kernel only reads them.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAIT | libc::FUTEX_PRIVATE_FLAG, seen, &raw const limit) };
}

fn futex_wake(word: &AtomicU32) {
    // SAFETY: the word lives through the call; the kernel only uses its address.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAKE | libc::FUTEX_PRIVATE_FLAG, 1) };
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn taken(bell: &Bell) -> Vec<usize> {
        let mut slots = Vec::new();
        bell.take(|slot| slots.push(slot));
        slots
    }

    #[test]
    fn each_place_that_rang_is_found_once() {
        let bell = Bell::new();
        for slot in [0, 63, 64, SLOTS - 1, 64] {
            bell.ring(slot);
        }
        bell.wait(Duration::from_secs(60));
        assert_eq!(taken(&bell), [0, 63, 64, SLOTS - 1]);
        assert!(taken(&bell).is_empty());
    }

    #[test]
    fn no_ring_is_lost_between_threads() {
        let bell = Arc::new(Bell::new());
        let ringing = bell.clone();
        let rings = std::thread::spawn(move || (0..10_000).for_each(|round| ringing.ring(round % SLOTS)));
        let mut seen = vec![false; SLOTS];
        while !seen.iter().all(|seen| *seen) {
            // The test would exceed its time limit if a ring could be missed.
            bell.wait(Duration::from_secs(3600));
            bell.take(|slot| seen[slot] = true);
        }
        rings.join().expect("ringing does not fail");
    }
}
