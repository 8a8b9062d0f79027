// SPDX-License-Identifier: Apache-2.0
//! The one clock of a real-time system: monotonic, or virtual.

/// Which clock a host lives by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockKind {
    /// CLOCK_MONOTONIC; every source is a thread.
    Monotonic,
    /// Time moves only by `Host::fire_next`; the whole system runs in the caller's thread, ordered by time, priority, RTP,
    /// source, request number. `seed` chooses preemptions.
    Virtual { seed: u64 },
}

/// CLOCK_MONOTONIC, ns. Real-time safe (no system call where the vDSO has the clock).
#[inline]
pub(crate) fn monotonic_ns() -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a timespec of our own; this clock always exists.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut time) };
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}
