// SPDX-License-Identifier: Apache-2.0
//! Roles of callers, each of which includes the permissions of the previous ones.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Role of a caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// May observe.
    Observe,
    /// May create, start and end verb instances, enable devices, store values, and acknowledge alarms.
    Operate,
    /// May change the configuration: processors, devices, definitions.
    Configure,
    /// May download code and files.
    Download,
}

impl Role {
    /// All roles, in order of increasing permissions.
    pub const ALL: [Role; 4] = [Role::Observe, Role::Operate, Role::Configure, Role::Download];

    /// Returns the name of the role.
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
        Role::ALL.into_iter().find(|role| role.word() == word).ok_or_else(|| format!("there is no role '{word}'; use observe, operate, configure or download"))
    }
}
