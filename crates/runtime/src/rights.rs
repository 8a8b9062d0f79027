// SPDX-License-Identifier: Apache-2.0
//! Rights that a source's thread requests from the operating system: priority, core, locked memory. Without them the source still works,
//! only later; rights not granted are reported in one line.
use kernel::SourceSpec;
use process_kit::{limit_real_time, may_lock_all};
use std::sync::OnceLock;

/// Requests the rights for the calling thread. Returns those not granted, and whether it runs at a real-time priority.
pub(crate) fn take(spec: &SourceSpec) -> (Vec<String>, bool) {
    let mut missing = Vec::new();
    // SAFETY: sets the timer slack of this thread.
    unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, 1_u64) };
    if !lock_memory() {
        missing.push("memory is not locked: no right to lock all of it (set memlock in limits.conf to unlimited)".to_owned());
    }
    if let Some(core) = spec.core
        && !pin(core)
    {
        missing.push(format!("source '{}' is not pinned: core {core} is not available to this process", spec.name));
    }
    let real_time = limit_real_time() && prioritise(spec.priority);
    if !real_time {
        missing.push(format!("source '{}' runs without priority {}: no right to real-time scheduling (set rtprio in limits.conf)", spec.name, spec.priority));
    }
    (missing, real_time)
}

/// Sets `priority` and `core` of the calling thread, which serves reports of kernels, if granted. Returns the rights not granted.
pub fn take_for_supervisor(priority: u8, core: Option<usize>) -> Vec<String> {
    let mut missing = Vec::new();
    // SAFETY: sets the timer slack of this thread.
    unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, 1_u64) };
    if let Some(core) = core
        && !pin(core)
    {
        missing.push(format!("the supervisor is not pinned: core {core} is not available to this process"));
    }
    if !(limit_real_time() && prioritise(priority)) {
        missing.push(format!("the supervisor runs without priority {priority}: no right to real-time scheduling (set rtprio in limits.conf)"));
    }
    missing
}

/// Raises the calling thread, which reports that kernels serve, above every kernel, if granted, so that neither kernels nor other
/// real-time programs hold it up.
pub fn take_for_heart() {
    const PRIORITY: u8 = 98;
    let _given = limit_real_time() && prioritise(PRIORITY);
}

/// Locks all memory of the process.
fn lock_memory() -> bool {
    static LOCKED: OnceLock<bool> = OnceLock::new();
    // SAFETY: asks for locked memory, which is the process's own.
    *LOCKED.get_or_init(|| may_lock_all() && unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE | MCL_ONFAULT) } == 0)
}

/// Locks a page when it is first touched, so that large reservations cost nothing; images are touched when they are made.
const MCL_ONFAULT: i32 = 4;

fn pin(core: usize) -> bool {
    if core >= libc::CPU_SETSIZE as usize {
        return false;
    }
    // SAFETY: a set of our own, for this thread.
    unsafe {
        let mut cores: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(core, &mut cores);
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &cores) == 0
    }
}

/// Sets SCHED_FIFO at `priority`, for this thread.
pub(crate) fn prioritise(priority: u8) -> bool {
    let parameter = libc::sched_param { sched_priority: i32::from(priority.clamp(1, 99)) };
    // SAFETY: this thread's own scheduling. Threads that it makes do not inherit it.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &parameter) == 0 }
}
