// SPDX-License-Identifier: Apache-2.0
//! The shelvings that an alarm remembers.
use model::wording::printable;
use serde::{Deserialize, Serialize};

/// Shelving of an alarm: a time that it is out of the list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Shelving {
    /// Person or session that shelved it.
    pub who: String,
    pub reason: String,
    /// Time at which it began, on the system's clock and on the wall (ns since 1970; under the virtual clock the system's own).
    pub time_ns: i64,
    pub wall_ns: i64,
    /// Time at which it is over at the latest.
    pub until_ns: i64,
    /// Time at which it ended; null while it lasts.
    pub ended_ns: Option<i64>,
    /// Person or session that ended it; empty: its time was over, or the alarm became one that cannot be shelved.
    pub ended_by: String,
}

impl Shelving {
    /// The same in texts that may be shown in a terminal.
    pub(crate) fn printable(self) -> Shelving {
        let (who, reason, ended_by) = (printable(self.who), printable(self.reason), printable(self.ended_by));
        Shelving { who, reason, ended_by, ..self }
    }
}
