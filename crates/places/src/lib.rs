// SPDX-License-Identifier: Apache-2.0
//! Places of remote processors: processes of this host that are started for them, and hosts that have joined.
//!
//! [`Places`] is given to a system; [`processor`] is what a process that was started for a processor does from its start to its end.
//! The command line that starts one is the programming system's: whatever it runs must come to call it. [`join`] is the life of a
//! process that lends its host to a remote system.
mod adopting;
mod door;
mod guarding;
#[cfg_attr(not(feature = "hosts"), path = "absent.rs")]
mod joined;
mod own;
mod process;
mod started;
mod telling;

pub use guarding::guard_processes;
pub use joined::{JoinOptions, join};
pub use process::processor;
pub use started::{Commands, Places};

pub(crate) fn text(why: impl std::fmt::Display) -> String {
    why.to_string()
}

/// Environment variables that a process gets with its link: name of the system, number of its run, the interpreter that tries code modules.
pub(crate) const SYSTEM: &str = "OPENGPAC_SYSTEM_NAME";
pub(crate) const RUN: &str = "OPENGPAC_SYSTEM_RUN";
pub(crate) const PYTHON: &str = "OPENGPAC_PYTHON";
/// Name of the process (for its processor, or as those that share it name it), and where the guard is found by a supervisor that takes it over.
pub(crate) const PROCESSOR: &str = "OPENGPAC_PROCESSOR";
pub(crate) const GUARD: &str = "OPENGPAC_GUARD_AT";

/// Names of the descriptors: the link, the way of safe handles to the guard, the heartbeat, those of the guard and the supervisor, what the sources say of the block that runs.
pub(crate) const LINK: &str = "link";
pub(crate) const HANDLES: &str = "handles";
pub(crate) const HEART: &str = "heart";
pub(crate) const GUARD_HEART: &str = "guard_heart";
pub(crate) const SUPERVISOR_HEART: &str = "supervisor_heart";
pub(crate) const BLACK_BOX: &str = "black_box";

/// Sources of a process that say which block runs.
pub(crate) const BLACK_BOX_SOURCES: usize = 64;
