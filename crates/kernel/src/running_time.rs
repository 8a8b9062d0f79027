// SPDX-License-Identifier: Apache-2.0
//! Running times: the time that the blocks of a process see, in each of its sources.
use crate::source::SourceId;
use opengpac::abi::Invocation;
use std::cell::UnsafeCell;
use std::ptr;
use std::sync::atomic::{AtomicPtr, Ordering};

/// Running times of one process, one per source: a list that only grows.
#[derive(Default)]
pub(crate) struct RunningTimes(AtomicPtr<RunningTime>);

// SAFETY: the list is atomic; each running time is touched by the kernel of its source alone.
unsafe impl Send for RunningTimes {}
// SAFETY: as for `Send`.
unsafe impl Sync for RunningTimes {}

/// Running time of a process in one source, as passed to its blocks.
pub struct RunningTime {
    source: SourceId,
    next: *mut RunningTime,
    state: UnsafeCell<TimeState>,
}

/// State that only the kernel of that source accesses.
#[derive(Default)]
pub struct TimeState {
    pub(crate) invocation: Invocation,
    /// Clock time at which the running time was 0, while it runs; the running time itself, while it is paused.
    base_ns: i64,
    runs: bool,
    /// Serving pass in which a condition of the process last took effect.
    pub(crate) moved: u64,
}

impl RunningTimes {
    /// Returns the running time of `source`; creates it if it is missing. Not on the real-time path.
    pub(crate) fn prepare(&self, source: SourceId) -> &RunningTime {
        let mut made: *mut RunningTime = ptr::null_mut();
        loop {
            let head = self.0.load(Ordering::Acquire);
            if let Some(found) = find(head, source) {
                if !made.is_null() {
                    // SAFETY: made below and never published.
                    drop(unsafe { Box::from_raw(made) });
                }
                return found;
            }
            if made.is_null() {
                made = Box::into_raw(Box::new(RunningTime { source, next: head, state: UnsafeCell::new(TimeState::default()) }));
            }
            // SAFETY: not published yet.
            unsafe { (*made).next = head };
            if self.0.compare_exchange(head, made, Ordering::AcqRel, Ordering::Acquire).is_ok() {
                // SAFETY: it stays until the process goes.
                return unsafe { &*made };
            }
        }
    }

    /// Returns the running time of `source`, if it was prepared.
    pub(crate) fn find(&self, source: SourceId) -> Option<&RunningTime> {
        find(self.0.load(Ordering::Acquire), source)
    }
}

impl Drop for RunningTimes {
    fn drop(&mut self) {
        let mut time = *self.0.get_mut();
        while !time.is_null() {
            // SAFETY: the list owns its members, and nobody else holds it.
            time = unsafe { Box::from_raw(time) }.next;
        }
    }
}

fn find<'a>(mut time: *mut RunningTime, source: SourceId) -> Option<&'a RunningTime> {
    while !time.is_null() {
        // SAFETY: members of the list stay until the process goes.
        let found = unsafe { &*time };
        if found.source == source {
            return Some(found);
        }
        time = found.next;
    }
    None
}

impl RunningTime {
    /// Returns the state that only the kernel of its source accesses.
    pub fn state(&self) -> *mut TimeState {
        self.state.get()
    }
}

impl TimeState {
    /// Updates the time that the blocks of the process see.
    #[inline]
    pub(crate) fn tell(&mut self, now_ns: i64) {
        self.invocation.now_ns = now_ns;
        self.invocation.time_ns = if self.runs { now_ns - self.base_ns } else { self.base_ns };
    }

    /// Starts the running time at 0.
    pub fn start(&mut self, now_ns: i64) {
        self.base_ns = now_ns;
        self.runs = true;
    }

    /// Continues another running time whose clock is ahead by `ahead_ns` (0 on the same host).
    pub fn keep(&mut self, other: &TimeState, ahead_ns: i64) {
        (self.base_ns, self.runs) = (if other.runs { other.base_ns - ahead_ns } else { other.base_ns }, other.runs);
    }

    /// Pauses the running time.
    pub(crate) fn stop(&mut self, now_ns: i64) {
        if self.runs {
            self.base_ns = now_ns - self.base_ns;
            self.runs = false;
        }
    }

    /// Resumes the running time.
    pub(crate) fn resume(&mut self, now_ns: i64) {
        if !self.runs {
            self.base_ns = now_ns - self.base_ns;
            self.runs = true;
        }
    }
}
