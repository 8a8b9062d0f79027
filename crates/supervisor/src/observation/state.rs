// SPDX-License-Identifier: Apache-2.0
//! State that the supervisor keeps for observers: log, end reports, taps and snapshots.
use crate::ending::latest::Ends;
use crate::observation::arms::Arms;
use crate::observation::log::Log;
use crate::observation::taps::Taps;
use crate::observation::workspaces::Workspaces;
use crate::scripts::Ticket;
use kernel::{Cell, SourceId};
use std::collections::HashMap;

#[derive(Default)]
pub(crate) struct Observation {
    pub log: Log,
    /// Latest end reports, for a programming system that was not connected when they were created.
    pub ends: Ends,
    /// Number of ends that have not been reported to an event loop yet.
    pub ended: u64,
    pub taps: Taps,
    /// Arms that programs have described.
    pub arms: Arms,
    /// Panel layouts for people who observe the system.
    pub workspaces: Workspaces,
    /// Snapshots that have arrived: ticket → (time, bytes of each script).
    pub reads: HashMap<Ticket, (i64, Vec<u8>)>,
    /// Cells of a recorded system whose SVVs are in the record.
    pub recorded: HashMap<(String, SourceId), Cell>,
}
