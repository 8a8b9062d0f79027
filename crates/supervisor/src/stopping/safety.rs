// SPDX-License-Identifier: Apache-2.0
//! State of stops, holds and reports in the supervisor.
use crate::alarms::list::Alarms;
use crate::devices::forces::Forces;
use crate::pausing::modes::Modes;
use crate::pausing::pause::Pause;
use crate::stopping::latch::Emergency;
use kernel::SourceId;
use std::collections::{HashMap, HashSet};

#[derive(Default)]
pub(crate) struct Safety {
    pub emergency: Emergency,
    pub pause: Pause,
    pub modes: Modes,
    pub alarms: Alarms,
    pub forces: Forces,
    /// Sources that did not answer; they are excluded from all waits.
    pub lost: HashSet<SourceId>,
    /// Sources that a test has cut off.
    pub cut_off: HashSet<SourceId>,
    /// Modules in which a signal was caught; they accept no new instances until a reset.
    pub poisoned: HashMap<String, String>,
    /// End of the last process suspension for which an alarm was raised, ns.
    pub stood_still_until_ns: Option<i64>,
    /// Sources that cannot run until the program is restarted, with the reasons.
    pub ended_for_good: HashMap<SourceId, String>,
}
