// SPDX-License-Identifier: Apache-2.0
//! Real-time priority and core of the calling thread. The only place that requests a real-time priority, because a limit has to be set first.
//!
//! A thread at a real-time priority that never sleeps takes its core away from every ordinary program. [`prioritise`] therefore limits the
//! processor time that such a thread may use without sleeping, and requests no priority if the limit cannot be set.

/// Processor time that a real-time thread may use without sleeping before the operating system signals it, µs: an independent barrier
/// against a runaway block, behind the time budget of blocks and with the same result (SIGXCPU counts as an exhausted budget). A process
/// without a handler for the signal ends.
const REAL_TIME_US_MAX: u64 = 5_000_000;

/// Scheduling of the threads and processes that a prioritised thread starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Children {
    /// They have no real-time priority until they request one.
    Ordinary,
    /// They inherit the priority.
    Inherit,
}

/// Requests the real-time priority (SCHED_FIFO) and exact timers for the calling thread. `priority` is limited to 1 to 99. Returns false if
/// the priority was not granted; the thread then runs as before.
pub fn prioritise(priority: u8, children: Children) -> bool {
    // SAFETY: sets the timer slack of this thread.
    unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, 1_u64) };
    let parameter = libc::sched_param { sched_priority: i32::from(priority.clamp(1, 99)) };
    let policy = libc::SCHED_FIFO | if children == Children::Ordinary { libc::SCHED_RESET_ON_FORK } else { 0 };
    #[expect(clippy::disallowed_methods, reason = "the limit has been set")]
    // SAFETY: sets the scheduling of this thread; the parameter lives through the call.
    let request = || unsafe { libc::sched_setscheduler(0, policy, &raw const parameter) } == 0;
    limit_real_time() && request()
}

/// Sets the limit for all threads of this process that run at a real-time priority, unless a lower one is in effect. Returns false if it
/// cannot be set.
fn limit_real_time() -> bool {
    // SAFETY: reads and lowers a limit of this process.
    unsafe {
        let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        if libc::getrlimit(libc::RLIMIT_RTTIME, &raw mut limit) != 0 {
            return false;
        }
        if limit.rlim_cur <= REAL_TIME_US_MAX {
            return true;
        }
        limit.rlim_cur = REAL_TIME_US_MAX.min(limit.rlim_max);
        libc::setrlimit(libc::RLIMIT_RTTIME, &raw const limit) == 0
    }
}

/// Pins the calling thread to a core. Returns false if the core does not exist or is not available to this process.
pub fn pin(core: usize) -> bool {
    if core >= libc::CPU_SETSIZE as usize {
        return false;
    }
    // SAFETY: sets the affinity of this thread; the set lives through the call.
    unsafe {
        let mut cores: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(core, &mut cores);
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const cores) == 0
    }
}
