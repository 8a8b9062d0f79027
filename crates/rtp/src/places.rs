// SPDX-License-Identifier: Apache-2.0
//! Where processors elsewhere come from.
use crate::Near;
use interconnect::Link;
use std::sync::Arc;
use std::time::Duration;

/// Starts processors in processes of this host, and finds those that joined from others. Given to a system by whoever makes it.
pub trait Places: Send + Sync {
    /// A process of this host for a processor.
    ///
    /// # Errors
    /// What keeps it from starting, in words.
    fn process(&self, processor: &str) -> Result<Started, String>;

    /// A host that has joined, for a processor.
    ///
    /// # Errors
    /// None of that name has joined, in words.
    fn host(&self, host: &str, processor: &str) -> Result<Started, String>;
}

/// A processor that runs, and nobody has greeted yet.
pub struct Started {
    /// To it.
    pub link: Arc<dyn Link>,
    /// What carries connections between this process and it.
    pub near: Near,
    /// Its process.
    pub running: Arc<dyn Running>,
    /// It is lost where nothing came for so long.
    pub silence: Duration,
}

/// The process of a processor.
pub trait Running: Send + Sync {
    /// Why it ended, in words: `was killed by signal 9 (SIGKILL)`. May wait a moment for its end to be known.
    fn cause(&self) -> String;

    /// Waits for its end, and ends it where it takes too long. Nothing of it is left.
    fn end(&self);
}
