// SPDX-License-Identifier: Apache-2.0
//! States of verb instances and logical devices, with the names used in calls.
use serde::Serialize;

/// State of a verb instance: created → (queued →) running ⇄ suspended → ended (→ running again by `start`) → deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum InstanceState {
    Created,
    /// Started, but waiting for claims held by other instances.
    Queued,
    Running,
    Suspended,
    Ended,
    /// Deleted; the number no longer refers to an instance.
    Deleted,
}

impl InstanceState {
    /// Parses a state, as returned by [`crate::System::state`].
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
    /// The device's own verb has been started but is not ready yet.
    Enabling,
    /// Enabled; no verb commands it.
    Standstill,
    /// Enabled; a verb commands it.
    Moving,
    /// Being disabled.
    Stopping,
    /// The device's own verb has ended by itself.
    Fault,
}

impl DeviceState {
    /// Parses a state, as returned by [`crate::System::device_state`].
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

/// Pauses in force: true for all actions, false for none, or the list of logical devices whose actions are paused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum PausesInForce {
    All(bool),
    Devices(Vec<String>),
}
