// SPDX-License-Identifier: Apache-2.0
//! Privileges that a process requests from the operating system, and privileges that it gives up.

/// Niceness of a low-priority process: normal processes get nine times its CPU time.
const NICE: libc::c_int = 10;

/// Permanently gives other processes precedence, for background work on a host that controls a machine.
pub fn stand_back() {
    // SAFETY: sets a priority of this process alone. Lowering it is never refused.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, NICE);
    }
}

/// Returns true if this process may lock any amount of memory; under a limit, later allocations would fail. Removes the limit if
/// permitted.
pub fn may_lock_all() -> bool {
    let any = libc::rlimit { rlim_cur: libc::RLIM_INFINITY, rlim_max: libc::RLIM_INFINITY };
    // SAFETY: a limit of the process's own.
    let taken_off = unsafe { libc::setrlimit(libc::RLIMIT_MEMLOCK, &any) == 0 };
    taken_off || ignores_the_limit()
}

/// Returns true if this process has CAP_IPC_LOCK, to which the limit does not apply.
fn ignores_the_limit() -> bool {
    const VERSION_3: u32 = 0x2008_0522;
    const IPC_LOCK: u32 = 1 << 14;
    /// Effective, permitted and inheritable capability sets, first for capabilities 0 to 31, then for the higher ones.
    type Sets = [[u32; 3]; 2];
    let (who, mut sets) = ([VERSION_3, 0], Sets::default());
    // SAFETY: the kernel reads a version and a process (0: this one), and writes the sets of that version.
    let asked = unsafe { libc::syscall(libc::SYS_capget, who.as_ptr(), sets.as_mut_ptr()) };
    asked == 0 && sets[0][0] & IPC_LOCK != 0
}
