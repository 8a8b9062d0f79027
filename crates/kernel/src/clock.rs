// SPDX-License-Identifier: Apache-2.0
//! The clock of this machine.

/// Returns CLOCK_MONOTONIC in ns. Real-time safe (no system call if the vDSO provides the clock).
#[inline]
pub fn monotonic_ns() -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a timespec of our own; this clock always exists.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut time) };
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}
