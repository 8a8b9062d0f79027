// SPDX-License-Identifier: Apache-2.0
//! Messages between a supervisor and its guard, as values: the command that starts a guard, its findings, its events.
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
    /// Path at which a later supervisor finds it with [`Guard::adopt`](crate::Guard::adopt), and the second guard at the same path with
    /// `2` appended; `None`: it cannot be found.
    pub path: Option<PathBuf>,
}

/// Events of the guard, reported in the order in which they happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GuardEvent {
    /// A process was lost; its outputs are safe.
    Lost(Loss),
    /// A process stood still; its outputs were made safe, and it was spared.
    MadeSafe(Loss),
    /// The process of this name continues.
    GoesOn(String),
    /// Rights that the operating system did not grant to the guard, one line each; reported once for each guard process that lacks any.
    Missing(Vec<String>),
    /// A guard had exited, and another one has taken over its registrations and now guards.
    Restarted {
        /// Cause of the previous one's end: "was killed by SIGKILL".
        how: String,
        /// Registrations that the new one could not take, human-readable.
        refused: Vec<String>,
    },
    /// A guard has exited permanently, with the reason; the other one guards alone.
    Alone(String),
    /// The guard has exited, with the reason: processes that die leave their outputs as they are.
    Gone(String),
}

/// A process guarded by the guard of a previous supervisor.
#[derive(Debug)]
pub struct FoundWard {
    /// Number with which it was registered.
    pub ward: u64,
    /// Name of the process.
    pub name: String,
    /// Handle of the process.
    pub process: Child,
    /// Devices of the process that have safe handles.
    pub devices: Vec<String>,
    /// Loss of the process, if it is lost.
    pub loss: Option<Loss>,
}

/// Error: the guard could not carry out a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GuardError(pub String);

impl fmt::Display for GuardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for GuardError {}
