// SPDX-License-Identifier: Apache-2.0
//! Descriptions of single items by name: an SVV, a private cell, a channel, a verb instance; and the names of all items.
use crate::observation::drawn::CellKind;
use crate::observation::states::InstanceState;
use indexmap::{IndexMap, IndexSet};
use model::interface::Interface;
use model::types::TypeTree;
use model::value::Value;
use serde::Serialize;

/// An SVV, a private cell of an instance (`move#1:coefficients`) or a channel of a physical device (`plant.elbow.position`).
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SvvAbout {
    pub name: String,
    pub kind: CellKind,
    /// C type as declared.
    pub type_text: String,
    /// Declarations of the struct types used by the type, by name.
    pub types: IndexMap<String, String>,
    /// Type with its layout.
    #[serde(rename = "type")]
    pub tree: TypeTree,
    pub unit: String,
    /// Number of values kept.
    pub history: u32,
    /// Logical device to which the SVV belongs.
    pub device: Option<String>,
    /// Ports that write the value, as `instance.label.port`.
    pub writers: Vec<String>,
    /// Ports that read the value.
    pub readers: Vec<String>,
    /// Number of verb instances that have a port bound to the value.
    pub bound: usize,
    /// Properties of an SVV.
    #[serde(flatten)]
    pub own: Option<SvvOwn>,
}

/// Properties specific to an SVV.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SvvOwn {
    /// Number of this SVV among all SVVs that have ever had the same name; `NAME@ID` refers to exactly this one.
    pub id: u32,
    /// Minimum and maximum that a programming system may write, if both are finite.
    pub within: Option<(f64, f64)>,
    /// Interrupt source that computed the current value; null if a programming system wrote it.
    pub source: Option<String>,
}

/// A verb instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstanceAbout {
    pub name: String,
    pub verb: String,
    pub state: InstanceState,
    pub blocks: Vec<BlockAbout>,
    /// Names of the command lists.
    pub lists: Vec<String>,
    /// Command list that is running or was the last to run.
    pub list: String,
    /// Names of the termination conditions, including those that every verb has.
    pub conditions: IndexSet<String>,
    /// Current values of the input parameters: those of the latest start, updated by later changes, or the defaults before the first
    /// start. Null if there is no value yet.
    pub inputs: IndexMap<String, Option<Value>>,
    /// Names of the output values.
    pub outputs: IndexSet<String>,
    /// Logical device whose own verb this instance runs, if any.
    pub owner: Option<String>,
    /// Number of starts.
    pub starts: u64,
    /// Running time since the start, excluding suspensions, s.
    pub running_s: f64,
    /// Remarks, for example about arguments that were added implicitly at creation.
    pub remarks: Vec<String>,
}

/// A block of a verb instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BlockAbout {
    /// Label of the block; in a nested graph, `outer.inner.block`.
    pub label: String,
    /// Function block, as `module.block`.
    pub block: String,
    /// Interrupt source that runs the block, `rtp.source`.
    pub source: String,
}

/// Names of all existing items.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Names {
    pub processors: Vec<String>,
    /// Processors outside the supervisor's process, by process.
    pub processes: IndexMap<String, Vec<String>>,
    /// Processor on which the supervisor runs.
    pub supervisor: Option<String>,
    /// Interrupt sources, `rtp.source`.
    pub sources: Vec<String>,
    /// Physical devices.
    pub devices: Vec<String>,
    pub svvs: Vec<String>,
    pub logical_devices: Vec<String>,
    pub verbs: Vec<String>,
    pub device_types: Vec<String>,
    /// Downloaded code modules.
    pub modules: Vec<String>,
    /// Function blocks, `module.block`.
    pub blocks: Vec<String>,
    /// Verb instances.
    pub instances: Vec<String>,
}

/// A code module: its blocks and struct types.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ModuleAbout {
    pub name: String,
    pub blocks: Vec<Interface>,
    /// Declarations of the struct types by name.
    pub types: Option<IndexMap<String, String>>,
    /// Remark about the module.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}
