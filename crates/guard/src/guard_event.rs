// SPDX-License-Identifier: Apache-2.0
//! Messages between a supervisor and its guard, as values: the command that starts a guard, the wards it finds, its events.
use crate::messages::Loss;
use process_kit::Child;
use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;

/// Command that starts a guard process, and the path at which the guard is found.
#[derive(Clone, Debug)]
pub struct GuardCommand {
    /// Command line of a process that calls [`guard::run`](crate::run).
    pub command: Vec<OsString>,
    /// Path at which a later supervisor finds the guard with [`Guard::adopt`](crate::Guard::adopt); the path of the second guard has `2`
    /// appended. `None`: the guard cannot be found.
    pub path: Option<PathBuf>,
}

/// Events of the guard, reported in the order in which they occurred.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GuardEvent {
    /// A process was lost; its outputs are safe.
    Lost(Loss),
    /// A process stalled; its outputs were made safe, and it was spared.
    MadeSafe(Loss),
    /// The process of this name has resumed.
    GoesOn(String),
    /// Privileges that the operating system did not grant to the guard, one line each; reported once for each guard process that lacks
    /// any.
    Missing(Vec<String>),
    /// A guard had exited, and another one has taken over its registrations and now guards.
    Restarted {
        /// Reason why the previous guard ended: "was killed by SIGKILL".
        how: String,
        /// Registrations that the new guard could not take over, human-readable.
        refused: Vec<String>,
    },
    /// A guard has exited permanently, with the reason; the other one guards alone.
    Alone(String),
    /// The guard has exited, with the reason: outputs of processes that die are no longer made safe.
    Gone(String),
}

/// A process guarded by the guard of a previous supervisor.
#[derive(Debug)]
pub struct FoundWard {
    /// Number under which the process was registered.
    pub ward: u64,
    /// Name of the process, as registered.
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
