// SPDX-License-Identifier: Apache-2.0
//! Reads the state of a thread of this process from the operating system.
use std::fs;

/// Returns true of the thread of this clock if it could run, or if a debugger or a stop signal keeps it from it. Where the system does not say,
/// false.
#[must_use]
pub fn waits_for_a_core(clock: libc::clockid_t) -> bool {
    // The number of the thread is in its clock, whose form is part of the system's face: its complement, above three bits.
    let Ok(text) = fs::read_to_string(format!("/proc/self/task/{}/stat", !(clock >> 3))) else { return false };
    let state = text.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next());
    matches!(state, Some('R' | 'T' | 't'))
}
