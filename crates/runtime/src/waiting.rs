// SPDX-License-Identifier: Apache-2.0
//! Query of a thread's state from the operating system.
use std::fs;

/// Returns true if the thread with this CPU-time clock is runnable, or is held by a debugger or a stop signal. Returns false if the
/// operating system does not report the state.
#[must_use]
pub fn waits_for_a_core(clock: libc::clockid_t) -> bool {
    // The clock ID contains the thread ID in a form guaranteed by the kernel ABI: its complement, above three bits.
    let Ok(text) = fs::read_to_string(format!("/proc/self/task/{}/stat", !(clock >> 3))) else { return false };
    let state = text.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next());
    matches!(state, Some('R' | 'T' | 't'))
}
