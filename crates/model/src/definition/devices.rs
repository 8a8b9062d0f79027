// SPDX-License-Identifier: Apache-2.0
//! Logical device types, and applications of a verb to devices and SVVs.
use super::Bound;
use crate::range::Range;
use crate::refusal::SourceLocation;
use crate::value::Value;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// Handling of a start that needs an item of a logical device held by another verb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Arbitration {
    /// The start is refused; the refusal names the holder.
    #[default]
    Refuse,
    /// The start waits until the items that it needs are free; starts are served in order.
    Queue,
    /// The holder is aborted, and then the verb is started.
    Abort,
}

/// Range of a member of a device type, or of an SVV. JSON: `"(0, inf)"`, or two bounds, each a number or the name of a parameter of the
/// device, for example `["position_min", "position_max"]` or `["-max_effort", "max_effort"]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Within {
    Range(Range),
    Between(Bound, Bound),
}

/// Initial value of an SVV of a logical device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Initial {
    Value(Value),
    /// Value of this SVV of the same device, copied once when the device is enabled.
    CopyOf(String),
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SvvSpecification {
    /// C type.
    pub type_text: String,
    #[serde(default)]
    pub unit: String,
    #[serde(default)]
    pub initial: Option<Initial>,
    /// Number of previous values kept for Python.
    #[serde(default)]
    pub history: u32,
    /// Range of values that the PS may store.
    #[serde(default)]
    pub within: Option<Within>,
    /// True if the PS keeps the value across a warm restart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keep: Option<bool>,
    /// Name of the system's SVV that all devices of the type share instead of each having its own.
    #[serde(default)]
    pub shared: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DeviceParameter {
    pub default: Value,
    #[serde(default)]
    pub unit: String,
    #[serde(default)]
    pub tunable: bool,
    /// Range of the parameter's values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<Within>,
    /// True if the PS keeps the value across a warm restart; if absent, true for a tunable parameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keep: Option<bool>,
}

/// A logical device type: an optional verb, SVVs, and parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DeviceType {
    pub name: String,
    #[serde(default)]
    pub doc: String,
    /// Name of the verb that operates the device; its parameters are matched to the members by name.
    #[serde(default)]
    pub verb: Option<String>,
    #[serde(default)]
    pub svvs: IndexMap<String, SvvSpecification>,
    #[serde(default)]
    pub parameters: IndexMap<String, DeviceParameter>,
    #[serde(default)]
    pub arbitration: Arbitration,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// Argument of an instantiation parameter or object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Argument {
    /// An SVV by name.
    Svv(String),
    /// One SVV per element of an array port.
    Svvs(Vec<String>),
    /// A channel of a physical device.
    Channel {
        device: String,
        channel: String,
    },
    /// A part of a physical device: `drive.position` of the verb is bound to its channel `part.position`.
    Part {
        device: String,
        part: String,
    },
    /// A logical device by name.
    Device(String),
    Devices(Vec<String>),
}

/// A verb applied to arguments: the definition of a verb instance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Application {
    /// Name of a verb defined in the system.
    pub verb: String,
    /// Name of the instance; if absent, `verb#n`.
    #[serde(default)]
    pub name: Option<String>,
    #[serde(default)]
    pub arguments: IndexMap<String, Argument>,
    /// Pattern for flat block labels (`planner`, `pid.*`, `*`) → source (`rtp0.fast`); the first match wins.
    #[serde(default)]
    pub placement: IndexMap<String, String>,
    /// Intervals changed by the application: label → ns.
    #[serde(default)]
    pub every: IndexMap<String, u64>,
    /// Values passed to a start, if they are to be checked as well.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub values: IndexMap<String, Value>,
    /// Logical device whose own verb this instance runs, if any.
    #[serde(default)]
    pub owner: Option<String>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}
