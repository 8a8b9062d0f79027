// SPDX-License-Identifier: Apache-2.0
//! Locations of remote processors: processes of this host that are started for them, and hosts that have joined.
//!
//! [`Places`] is passed to a system; [`processor`] is the main function of a process that was started for a processor. The programming
//! system provides the command line of such a process, which must call that function. [`join`] is the main function of a process that
//! lends its host to a remote system.
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

/// Environment variables passed to a process with its link: name of the system, and number of its run.
pub(crate) const SYSTEM: &str = "OPENGPAC_SYSTEM_NAME";
pub(crate) const RUN: &str = "OPENGPAC_SYSTEM_RUN";
/// Further variables: the name of the process (its processor, or the common name of several), and the path at which a supervisor that
/// takes it over finds the guard.
pub(crate) const PROCESSOR: &str = "OPENGPAC_PROCESSOR";
pub(crate) const GUARD: &str = "OPENGPAC_GUARD_AT";

/// Names of the inherited descriptors: the link, the link for safe handles to the guard, the heartbeat, the heartbeats of the guard and
/// of the supervisor, and the memory in which sources record the running block.
pub(crate) const LINK: &str = "link";
pub(crate) const HANDLES: &str = "handles";
pub(crate) const HEART: &str = "heart";
pub(crate) const GUARD_HEART: &str = "guard_heart";
pub(crate) const SUPERVISOR_HEART: &str = "supervisor_heart";
pub(crate) const BLACK_BOX: &str = "black_box";

/// Maximum number of sources of a process that record the running block.
pub(crate) const BLACK_BOX_SOURCES: usize = 64;
