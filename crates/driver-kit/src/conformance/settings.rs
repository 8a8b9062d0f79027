// SPDX-License-Identifier: Apache-2.0
//! Settings for the check of a driver.
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

/// Settings for the check of a driver.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Command line of a process that calls [`serve`](super::serve).
    pub command: Vec<OsString>,
    /// Maximum number of exchanges in the memory check.
    pub exchanges: u64,
    /// Shared object built from [`COUNTING`](super::Settings::COUNTING), which counts allocations; without it, the memory check detects
    /// only memory that is not freed.
    pub counting: Option<PathBuf>,
    /// Real-time sanitizer, as built by [`sanitizer_in`](super::sanitizer_in); without it, the check under the sanitizer is reported as
    /// not carried out.
    pub sanitizer: Option<PathBuf>,
    /// Time limit of a check.
    pub limit: Duration,
}

impl Settings {
    /// C source of the allocation counter.
    pub const COUNTING: &'static str = include_str!("counting.c");
}
