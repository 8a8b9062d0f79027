// SPDX-License-Identifier: Apache-2.0
//! Roles: what a caller may do, each with all that the ones before it may.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A role of a caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Looks.
    Observe,
    /// Makes, starts and ends verb instances, enables devices, stores values, acknowledges.
    Operate,
    /// Changes what there is: processors, devices, definitions.
    Configure,
    /// Brings code and files.
    Download,
}

impl Role {
    /// All roles, in the order of what they may do.
    pub const ALL: [Role; 4] = [Role::Observe, Role::Operate, Role::Configure, Role::Download];

    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Role::Observe => "observe",
            Role::Operate => "operate",
            Role::Configure => "configure",
            Role::Download => "download",
        }
    }
}

impl FromStr for Role {
    type Err = String;

    fn from_str(word: &str) -> Result<Role, String> {
        Role::ALL.into_iter().find(|role| role.word() == word).ok_or_else(|| format!("there is no role '{word}'; take observe, operate, configure or download"))
    }
}
