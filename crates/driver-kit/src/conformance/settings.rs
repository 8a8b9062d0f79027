// SPDX-License-Identifier: Apache-2.0
//! Settings of the check of a driver.
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

/// Settings of the check of a driver.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Command line of a process that calls [`serve`](super::serve).
    pub command: Vec<OsString>,
    /// Maximum number of exchanges of the memory check.
    pub exchanges: u64,
    /// Shared object made from [`COUNTING`](super::Settings::COUNTING), which counts allocations; without it that check detects only
    /// memory that is not freed.
    pub counting: Option<PathBuf>,
    /// Real-time sanitizer, as made by [`sanitizer_in`](super::sanitizer_in); without it that check reports that it was not made.
    pub sanitizer: Option<PathBuf>,
    /// Time limit of a check.
    pub limit: Duration,
}

impl Settings {
    /// C source of the counter of allocations.
    pub const COUNTING: &'static str = include_str!("counting.c");
}
