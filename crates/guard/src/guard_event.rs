// SPDX-License-Identifier: Apache-2.0
//! Messages between a supervisor and its guard, as values: the command that starts a guard, what it found, what happened.
use crate::messages::Loss;
use process_kit::Child;
use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;

/// Command that starts a guard process, and its address.
#[derive(Clone, Debug)]
pub struct GuardCommand {
    /// A command line whose process calls [`guard::run`](crate::run).
    pub command: Vec<OsString>,
    /// Path at which a later supervisor finds it with [`Guard::adopt`](crate::Guard::adopt), and the second guard at the same path with `2` behind it;
    /// none: nowhere.
    pub path: Option<PathBuf>,
}

/// Event of the guard, in the order in which they happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GuardEvent {
    /// A process is lost; its outputs are safe.
    Lost(Loss),
    /// This process stood still; its outputs were made safe, and it was spared.
    MadeSafe(Loss),
    /// The process of this name goes on.
    GoesOn(String),
    /// Rights that the operating system did not give the guard, one line each; once for each guard process that lacks something.
    Missing(Vec<String>),
    /// One of the two guards was gone; another one has taken what was registered, and guards now.
    Restarted {
        /// End of the last one: "was killed by SIGKILL".
        how: String,
        /// Registrations that the new one could not take, in words.
        refused: Vec<String>,
    },
    /// One of the two guards is gone for good, and why; the other one guards alone.
    Alone(String),
    /// The guard is gone, and why: processes that die leave their outputs as they are.
    Gone(String),
}

/// A process that a guard of a predecessor guards.
#[derive(Debug)]
pub struct FoundWard {
    /// The number it was registered with.
    pub ward: u64,
    /// Its name.
    pub name: String,
    /// The process.
    pub process: Child,
    /// Its devices that have safe handles.
    pub devices: Vec<String>,
    /// Loss of the process, and its time.
    pub loss: Option<Loss>,
}

/// Error: the guard could not do what it was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GuardError(pub String);

impl fmt::Display for GuardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for GuardError {}
