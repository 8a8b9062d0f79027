// SPDX-License-Identifier: Apache-2.0
//! States of verb instances and logical devices as named in calls.
use serde::Serialize;

/// State of a verb instance: created → (queued →) running ⇄ suspended → ended (→ running again by `start`) → deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum InstanceState {
    Created,
    /// Started, and waiting for claims held by other instances.
    Queued,
    Running,
    Suspended,
    Ended,
    /// The instance with that number was deleted.
    Deleted,
}

impl InstanceState {
    /// Returns the state for a word returned by [`crate::System::state`].
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
    /// The device's own verb has been started and is not ready yet.
    Enabling,
    /// The device is enabled, and no verb commands it.
    Standstill,
    /// The device is enabled, and a verb commands it.
    Moving,
    /// The device is being disabled.
    Stopping,
    /// The device's own verb has ended by itself.
    Fault,
}

impl DeviceState {
    /// Returns the state for a word returned by [`crate::System::device_state`].
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

/// Pauses in force: true for all actions, false for none, or a list of logical devices whose actions are paused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum PausesInForce {
    All(bool),
    Devices(Vec<String>),
}
