// SPDX-License-Identifier: Apache-2.0
//! Privileges that a source's thread requests from the operating system: priority, core, locked memory. Without them the source still
//! runs, but its firings may be delayed. Privileges that are not granted are reported in one line.
use kernel::SourceSpec;
use process_kit::may_lock_all;
use scheduling::{Children, pin, prioritise};
use std::sync::OnceLock;

/// Requests the privileges for the calling thread. Returns those not granted, and true if the thread runs at a real-time priority.
pub(crate) fn take(spec: &SourceSpec) -> (Vec<String>, bool) {
    let mut missing = Vec::new();
    if !lock_memory() {
        missing.push("memory is not locked: no permission to lock all of it (set memlock in limits.conf to unlimited)".to_owned());
    }
    if let Some(core) = spec.core
        && !pin(core)
    {
        missing.push(format!("source '{}' is not pinned: core {core} is not available to this process", spec.name));
    }
    let real_time = prioritise(spec.priority, Children::Ordinary);
    if !real_time {
        missing.push(format!(
            "source '{}' runs without priority {}: no permission for real-time scheduling (set rtprio in limits.conf)",
            spec.name, spec.priority
        ));
    }
    (missing, real_time)
}

/// Sets the priority and the core of the calling thread, which serves reports from kernels, as far as permitted. Returns the privileges
/// not granted.
pub fn take_for_supervisor(priority: u8, core: Option<usize>) -> Vec<String> {
    let mut missing = Vec::new();
    if let Some(core) = core
        && !pin(core)
    {
        missing.push(format!("the supervisor is not pinned: core {core} is not available to this process"));
    }
    if !prioritise(priority, Children::Ordinary) {
        missing.push(format!("the supervisor runs without priority {priority}: no permission for real-time scheduling (set rtprio in limits.conf)"));
    }
    missing
}

/// Raises the priority of the calling thread above every kernel, if the process has the privilege. The thread reports that kernels serve,
/// so neither kernels nor other real-time programs may delay it.
pub fn take_for_heart() {
    const PRIORITY: u8 = 98;
    let _given = prioritise(PRIORITY, Children::Ordinary);
}

/// Locks all memory of the process.
fn lock_memory() -> bool {
    static LOCKED: OnceLock<bool> = OnceLock::new();
    // SAFETY: asks for locked memory, which is the process's own.
    *LOCKED.get_or_init(|| may_lock_all() && unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE | MCL_ONFAULT) } == 0)
}

/// Locks a page when it is first touched, so that large reservations cost nothing; images are touched when they are created.
const MCL_ONFAULT: i32 = 4;
