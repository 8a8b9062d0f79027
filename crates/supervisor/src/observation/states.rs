// SPDX-License-Identifier: Apache-2.0
//! States of verb instances and logical devices as the calls name them.
use serde::Serialize;

/// State of a verb instance: created → (queued →) running ⇄ suspended → ended (→ running again by `start`) → deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum InstanceState {
    Created,
    /// Started, and waiting for what other instances hold.
    Queued,
    Running,
    Suspended,
    Ended,
    /// The instance of that number was deleted.
    Deleted,
}

impl InstanceState {
    /// Returns the state that [`crate::System::state`] names.
    pub fn named(word: &str) -> InstanceState {
        match word {
            "created" => InstanceState::Created,
            "queued" => InstanceState::Queued,
            "running" => InstanceState::Running,
            "suspended" => InstanceState::Suspended,
            "ended" => InstanceState::Ended,
            _ => InstanceState::Deleted,
        }
    }
}

/// State of a logical device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum DeviceState {
    Disabled,
    /// Its verb has been started and is not ready yet.
    Enabling,
    /// Enabled, and no verb commands it.
    Standstill,
    /// Enabled, and a verb commands it.
    Moving,
    /// The device is being disabled.
    Stopping,
    /// Its verb has ended by itself.
    Fault,
}

impl DeviceState {
    /// Returns the state that [`crate::System::device_state`] names.
    pub fn named(word: &str) -> DeviceState {
        match word {
            "disabled" => DeviceState::Disabled,
            "enabling" => DeviceState::Enabling,
            "standstill" => DeviceState::Standstill,
            "moving" => DeviceState::Moving,
            "stopping" => DeviceState::Stopping,
            _ => DeviceState::Fault,
        }
    }
}

/// Pauses in force: true: all actions; false: none; a list: the actions on these logical devices.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum PausesInForce {
    All(bool),
    Devices(Vec<String>),
}
