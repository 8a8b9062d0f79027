// SPDX-License-Identifier: Apache-2.0
//! State that the supervisor keeps for observers: log, end reports, taps, snapshots.
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
    /// The latest end reports, for a programming system that was not there.
    pub ends: Ends,
    /// Ends not yet told to an event loop.
    pub ended: u64,
    pub taps: Taps,
    /// Arms that programs have described.
    pub arms: Arms,
    /// Layouts of panels, which people look at it with.
    pub workspaces: Workspaces,
    /// Snapshots that have arrived: ticket → (time, bytes of each script).
    pub reads: HashMap<Ticket, (i64, Vec<u8>)>,
    /// Cells of a recorded system whose SVV the record knows.
    pub recorded: HashMap<(String, SourceId), Cell>,
}
