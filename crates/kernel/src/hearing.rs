// SPDX-License-Identifier: Apache-2.0
//! Test of whether a thread that repeatedly fails to receive a signal is blocking it, or merely had no core to run on.
use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};

/// Number of signals after which a thread is checked; a thread that shares its core usually runs before that many have been sent.
const UNHEARD_MAX: u32 = 50;

/// CPU time since the first signal within which a thread must have received it. A signal is delivered before the next instruction of the
/// program.
const RUN_MAX_NS: i64 = 10_000_000;

/// Signals that were sent to a thread but not received.
#[derive(Default)]
pub(crate) struct Unheard {
    count: AtomicU32,
    /// CPU time of the thread when the first signal was sent, ns; -1 if unknown.
    run_ns: AtomicI64,
}

impl Unheard {
    pub(crate) fn clear(&self) {
        self.count.store(0, Ordering::Relaxed);
    }

    /// Counts a signal that was sent to `thread`, which is alive or was never joined.
    pub(crate) fn add(&self, thread: libc::pthread_t) {
        if self.count.fetch_add(1, Ordering::Relaxed) == 0 {
            self.run_ns.store(run_ns(thread).unwrap_or(-1), Ordering::Relaxed);
        }
    }

    /// Returns true if `thread` has failed to receive so many signals that it must be blocking them. A thread that is waiting for a core,
    /// as reported by `waits`, is not considered to block them.
    pub(crate) fn is_deaf(&self, thread: libc::pthread_t, waits: impl Fn(libc::clockid_t) -> bool) -> bool {
        if self.count.load(Ordering::Relaxed) <= UNHEARD_MAX {
            return false;
        }
        let before_ns = self.run_ns.load(Ordering::Relaxed);
        let has_run = run_ns(thread).is_none_or(|now_ns| before_ns < 0 || now_ns - before_ns > RUN_MAX_NS);
        has_run || !clock(thread).is_some_and(waits)
    }
}

/// Returns the CPU-time clock of a thread; `None` if it has exited.
pub(crate) fn clock(thread: libc::pthread_t) -> Option<libc::clockid_t> {
    let mut clock = 0;
    // SAFETY: the caller's word for the thread.
    (unsafe { libc::pthread_getcpuclockid(thread, &mut clock) } == 0).then_some(clock)
}

/// Returns the CPU time that a thread has used; `None` if it has exited.
pub(crate) fn run_ns(thread: libc::pthread_t) -> Option<i64> {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: asks for a time.
    (unsafe { libc::clock_gettime(clock(thread)?, &mut time) } == 0).then_some(time.tv_sec * 1_000_000_000 + time.tv_nsec)
}

/// Returns true if this process has no thread `id`.
pub(crate) fn is_gone(id: i32) -> bool {
    // SAFETY: asks whether it could be sent a signal.
    let sent = unsafe { libc::syscall(libc::SYS_tgkill, libc::getpid(), id, 0) };
    sent != 0 && std::io::Error::last_os_error().raw_os_error() == Some(libc::ESRCH)
}
