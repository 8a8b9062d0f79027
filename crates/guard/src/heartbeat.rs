// SPDX-License-Identifier: Apache-2.0
//! The heartbeat: a word that a process counts up as long as it serves, and that the guard watches.
use crate::SharedMemory;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::atomic::Ordering;

/// One process's heartbeat, in shared memory. It is watched from its first beat on.
#[derive(Debug)]
pub struct Heartbeat {
    memory: SharedMemory,
}

impl Heartbeat {
    /// A heartbeat that has not beaten yet.
    ///
    /// # Errors
    /// No memory or descriptors left.
    pub fn new() -> io::Result<Heartbeat> {
        Ok(Heartbeat { memory: SharedMemory::new(8)? })
    }

    /// The heartbeat that another process made and sent.
    ///
    /// # Errors
    /// `InvalidData` for a descriptor that is none.
    pub fn received(descriptor: OwnedFd) -> io::Result<Heartbeat> {
        Ok(Heartbeat { memory: SharedMemory::received(descriptor, 8)? })
    }

    /// Beats: one atomic store. Real-time safe. One thread does this.
    #[inline]
    pub fn beat(&self) {
        let word = self.memory.word(0);
        word.store(word.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
    }

    /// How often it has beaten.
    #[inline]
    pub fn count(&self) -> u64 {
        self.memory.word(0).load(Ordering::Acquire)
    }

    /// A descriptor of it, for the process that beats or the guard.
    ///
    /// # Errors
    /// No descriptors left.
    pub fn descriptor(&self) -> io::Result<OwnedFd> {
        self.memory.descriptor()
    }
}

/// A shorter bound would judge the scheduler, not the process.
const BOUND_NS_MIN: i64 = 10_000_000;

/// Judges a heartbeat that is looked at now and then.
#[derive(Debug)]
pub(crate) struct Pulse {
    heartbeat: Heartbeat,
    bound_ns: i64,
    seen: u64,
    looked_ns: i64,
    still_ns: i64,
}

impl Pulse {
    pub fn new(heartbeat: Heartbeat, bound_ns: i64, now_ns: i64) -> Pulse {
        Pulse { seen: heartbeat.count(), heartbeat, bound_ns: bound_ns.max(BOUND_NS_MIN), looked_ns: now_ns, still_ns: 0 }
    }

    /// How often to look.
    pub fn interval_ns(&self) -> i64 {
        (self.bound_ns / 10).max(1_000_000)
    }

    /// Whether it has stood still for the bound. A long time between two looks counts as two intervals only: then it was the
    /// guard, or the whole machine, that stood still.
    pub fn is_frozen(&mut self, now_ns: i64) -> bool {
        let elapsed_ns = (now_ns - self.looked_ns).clamp(0, 2 * self.interval_ns());
        self.looked_ns = now_ns;
        let count = self.heartbeat.count();
        let beats = count != self.seen || count == 0;
        self.seen = count;
        self.still_ns = if beats { 0 } else { self.still_ns + elapsed_ns };
        self.still_ns >= self.bound_ns
    }

    pub fn heartbeat(&self) -> &Heartbeat {
        &self.heartbeat
    }

    pub fn bound_ns(&self) -> i64 {
        self.bound_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn pulse() -> Pulse {
        Pulse::new(Heartbeat::new().expect("memory"), 500 * MS, 0)
    }

    #[test]
    fn a_heart_that_has_not_beaten_yet_is_not_frozen() {
        let mut pulse = pulse();
        assert!((1..100).all(|look| !pulse.is_frozen(look * 50 * MS)));
    }

    #[test]
    fn a_heart_that_stands_still_for_the_bound_is_frozen() {
        let mut pulse = pulse();
        pulse.heartbeat.beat();
        assert!((1..=10).all(|look| !pulse.is_frozen(look * 50 * MS)), "first seen at 50 ms, so still for 450 ms at 500 ms");
        assert!(pulse.is_frozen(550 * MS));
    }

    #[test]
    fn a_beat_starts_the_bound_anew() {
        let mut pulse = pulse();
        for look in 1..100 {
            if look % 9 == 0 {
                pulse.heartbeat.beat();
            }
            assert!(!pulse.is_frozen(look * 50 * MS));
        }
    }

    #[test]
    fn a_guard_that_was_held_up_blames_nobody() {
        let mut pulse = pulse();
        pulse.heartbeat.beat();
        assert!(!pulse.is_frozen(50 * MS));
        assert!(!pulse.is_frozen(5_000 * MS), "one look: the machine stood still, not the process");
        pulse.heartbeat.beat();
        assert!(!pulse.is_frozen(5_050 * MS));
    }
}
