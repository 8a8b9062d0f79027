// SPDX-License-Identifier: Apache-2.0
//! The heartbeat: a word that a process counts up as long as it serves, and that others watch.
use crate::SharedMemory;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::atomic::Ordering;

/// The beats, who the canary is, what keeps the heart from beating, and why its process was ended.
const LEN: usize = 32;
const CANARY: usize = 8;
const HELD_UP: usize = 16;
const ENDED_FOR: usize = 24;

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
        Ok(Heartbeat { memory: SharedMemory::new(LEN)? })
    }

    /// The heartbeat that another process made and sent.
    ///
    /// # Errors
    /// `InvalidData` for a descriptor that is none.
    pub fn received(descriptor: OwnedFd) -> io::Result<Heartbeat> {
        Ok(Heartbeat { memory: SharedMemory::received(descriptor, LEN)? })
    }

    /// Beats: one atomic store. Real-time safe. One thread does this.
    #[inline]
    pub fn beat(&self) {
        let word = self.memory.word(0);
        word.store(word.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
    }

    /// Number of beats.
    #[inline]
    pub fn count(&self) -> u64 {
        self.memory.word(0).load(Ordering::Acquire)
    }

    /// The thread that beat it is gone, and the next one has not beaten yet.
    pub fn begin(&self) {
        self.memory.word(0).store(0, Ordering::Release);
    }

    /// Canary of this heart: a thread whose end says that its process is dying; 0: there is none.
    pub fn canary(&self) -> u64 {
        self.memory.word(CANARY).load(Ordering::Acquire)
    }

    /// Says who it is.
    pub fn set_canary(&self, who: u64) {
        self.memory.word(CANARY).store(who, Ordering::Release);
    }

    /// Returns what keeps it from beating: a number from 0 on that the process and its watcher agree on; none where nothing does.
    pub fn held_up_by(&self) -> Option<usize> {
        let word = self.memory.word(HELD_UP).load(Ordering::Acquire);
        usize::try_from(word).ok()?.checked_sub(1)
    }

    /// Says what keeps it from beating, or that nothing does.
    pub fn hold_up(&self, by: Option<usize>) {
        self.memory.word(HELD_UP).store(by.map_or(0, |number| number as u64 + 1), Ordering::Release);
    }

    /// Returns why a watcher ended its process, by a number from 1 on that all watchers agree on; 0: none did.
    pub fn ended_for(&self) -> u64 {
        self.memory.word(ENDED_FOR).load(Ordering::Acquire)
    }

    /// Notes why its process is about to be ended, for everybody else who watches. The first reason stays.
    pub fn end_for(&self, why: u64) {
        // Where there is a reason already, that one stays.
        let _first = self.memory.word(ENDED_FOR).compare_exchange(0, why, Ordering::AcqRel, Ordering::Acquire);
    }

    /// A descriptor of it, for the process that beats or one that watches.
    ///
    /// # Errors
    /// No descriptors left.
    pub fn descriptor(&self) -> io::Result<OwnedFd> {
        self.memory.descriptor()
    }
}
