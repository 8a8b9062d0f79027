// SPDX-License-Identifier: Apache-2.0
//! Heartbeat: a counter that a process increments as long as it serves, and that other processes watch.
use crate::SharedMemory;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::atomic::Ordering;

/// Size of the memory in bytes: beats, canary, obstacle to beating, and reason for ending the process.
const LEN: usize = 32;
const CANARY: usize = 8;
const HELD_UP: usize = 16;
const ENDED_FOR: usize = 24;

/// Heartbeat of one process, in shared memory. It is watched from its first beat.
#[derive(Debug)]
pub struct Heartbeat {
    memory: SharedMemory,
}

impl Heartbeat {
    /// Creates a heartbeat that has not beaten yet.
    ///
    /// # Errors
    /// Fails if no memory or descriptors are left.
    pub fn new() -> io::Result<Heartbeat> {
        Ok(Heartbeat { memory: SharedMemory::new(LEN)? })
    }

    /// Maps a heartbeat that another process created and sent.
    ///
    /// # Errors
    /// `InvalidData` if the descriptor does not refer to a heartbeat.
    pub fn received(descriptor: OwnedFd) -> io::Result<Heartbeat> {
        Ok(Heartbeat { memory: SharedMemory::received(descriptor, LEN)? })
    }

    /// Beats once, with one atomic store. Called by one thread. Real-time safe.
    #[inline]
    pub fn beat(&self) {
        let word = self.memory.word(0);
        word.store(word.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
    }

    /// Returns the number of beats.
    #[inline]
    pub fn count(&self) -> u64 {
        self.memory.word(0).load(Ordering::Acquire)
    }

    /// Resets the count, because the beating thread has exited and its successor has not beaten yet.
    pub fn begin(&self) {
        self.memory.word(0).store(0, Ordering::Release);
    }

    /// Returns the canary of this heart: a thread whose exit indicates that the process is dying; 0 if there is none.
    pub fn canary(&self) -> u64 {
        self.memory.word(CANARY).load(Ordering::Acquire)
    }

    /// Sets the canary.
    pub fn set_canary(&self, who: u64) {
        self.memory.word(CANARY).store(who, Ordering::Release);
    }

    /// Returns the obstacle that keeps the heart from beating: a number, starting at 0, on whose meaning the process and its watcher
    /// agree; `None` if there is no obstacle.
    pub fn held_up_by(&self) -> Option<usize> {
        let word = self.memory.word(HELD_UP).load(Ordering::Acquire);
        usize::try_from(word).ok()?.checked_sub(1)
    }

    /// Sets or clears the obstacle that keeps the heart from beating.
    pub fn hold_up(&self, by: Option<usize>) {
        self.memory.word(HELD_UP).store(by.map_or(0, |number| number as u64 + 1), Ordering::Release);
    }

    /// Returns the reason for which a watcher terminated the process: a number, starting at 1, on whose meaning all watchers agree; 0 if
    /// no watcher terminated it.
    pub fn ended_for(&self) -> u64 {
        self.memory.word(ENDED_FOR).load(Ordering::Acquire)
    }

    /// Records, for all other watchers, the reason for which the process is about to be terminated. The first reason is kept.
    pub fn end_for(&self, why: u64) {
        // An existing reason is kept.
        let _first = self.memory.word(ENDED_FOR).compare_exchange(0, why, Ordering::AcqRel, Ordering::Acquire);
    }

    /// Returns a descriptor of the heartbeat, for the process that beats or for one that watches it.
    ///
    /// # Errors
    /// Fails if no descriptors are left.
    pub fn descriptor(&self) -> io::Result<OwnedFd> {
        self.memory.descriptor()
    }
}
