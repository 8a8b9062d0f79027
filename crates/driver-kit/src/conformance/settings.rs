// SPDX-License-Identifier: Apache-2.0
//! Settings of the check of a driver.
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

/// Settings of the check of a driver.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The command line of a process that calls [`serve`](super::serve).
    pub command: Vec<OsString>,
    /// Maximum number of exchanges of the check of memory.
    pub exchanges: u64,
    /// A shared object made of [`COUNTING`](super::Settings::COUNTING), which counts allocations; without one the check of them sees only what
    /// is not given back.
    pub counting: Option<PathBuf>,
    /// The real-time sanitizer, as [`sanitizer_in`](super::sanitizer_in) makes it; without it that check says that it was not made.
    pub sanitizer: Option<PathBuf>,
    /// Time limit of a check.
    pub limit: Duration,
}

impl Settings {
    /// The source in C of what counts allocations.
    pub const COUNTING: &'static str = include_str!("counting.c");
}
