// SPDX-License-Identifier: Apache-2.0
//! Shelvings recorded with an alarm.
use model::wording::printable;
use serde::{Deserialize, Serialize};

/// Shelving of an alarm: a period for which it is removed from the list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Shelving {
    /// Person or session that shelved the alarm.
    pub who: String,
    pub reason: String,
    /// Time at which the alarm was shelved, on the system's clock and on the wall clock (ns since the Unix epoch; if the system's clock
    /// is virtual, its time is used for both).
    pub time_ns: i64,
    pub wall_ns: i64,
    /// Time at which the shelving expires.
    pub until_ns: i64,
    /// Time at which the shelving ended; null as long as it lasts.
    pub ended_ns: Option<i64>,
    /// Person or session that ended the shelving; empty if it expired, or if it ended because the alarm can no longer be shelved.
    pub ended_by: String,
}

impl Shelving {
    /// Makes the texts of the shelving safe for a terminal.
    pub(crate) fn printable(self) -> Shelving {
        let (who, reason, ended_by) = (printable(self.who), printable(self.reason), printable(self.ended_by));
        Shelving { who, reason, ended_by, ..self }
    }
}
