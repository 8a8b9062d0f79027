// SPDX-License-Identifier: Apache-2.0
//! Description of one thing by its name: an SVV, a private cell, a channel, a verb instance; and the names of all.
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
    /// Declarations of the struct types that it needs, by name.
    pub types: IndexMap<String, String>,
    /// The type with its layout.
    #[serde(rename = "type")]
    pub tree: TypeTree,
    pub unit: String,
    /// Number of its values that are kept.
    pub history: u32,
    /// The logical device that it belongs to.
    pub device: Option<String>,
    /// Ports that write it, `instance.label.port`.
    pub writers: Vec<String>,
    /// Ports that read it.
    pub readers: Vec<String>,
    /// Verb instances with a port bound to it.
    pub bound: usize,
    /// Properties of an SVV.
    #[serde(flatten)]
    pub own: Option<SvvOwn>,
}

/// Properties that only an SVV has.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SvvOwn {
    /// Number of this SVV among those that have had its name; `NAME@ID` is this one and no other.
    pub id: u32,
    /// Minimum and maximum that a programming system may write, where both are finite.
    pub within: Option<(f64, f64)>,
    /// The interrupt source in which its present value was computed; null: a programming system wrote it.
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
    /// Names of its command lists.
    pub lists: Vec<String>,
    /// The command list that runs, or ran last.
    pub list: String,
    /// Names of its termination conditions, those of every verb too.
    pub conditions: IndexSet<String>,
    /// The present values of its input parameters: those of its latest start with what was changed since; before the first one the
    /// defaults. Null: it has none yet.
    pub inputs: IndexMap<String, Option<Value>>,
    /// Names of its output values.
    pub outputs: IndexSet<String>,
    /// The logical device whose own verb it is.
    pub owner: Option<String>,
    /// Number of its starts.
    pub starts: u64,
    /// Time for which it has run since its start, without the time that it was suspended, s.
    pub running_s: f64,
    /// Arguments that were filled in when it was made, and other remarks.
    pub remarks: Vec<String>,
}

/// A block of a verb instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BlockAbout {
    /// A block of a nested graph: `outer.inner.block`.
    pub label: String,
    /// `module.block`.
    pub block: String,
    /// The interrupt source that runs it, `rtp.source`.
    pub source: String,
}

/// The names of what there is.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Names {
    pub processors: Vec<String>,
    /// Processors by the process that they run in, of those that do not run in the supervisor's.
    pub processes: IndexMap<String, Vec<String>>,
    /// The processor that the supervisor runs on.
    pub supervisor: Option<String>,
    /// Interrupt sources, `rtp.source`.
    pub sources: Vec<String>,
    /// Physical devices.
    pub devices: Vec<String>,
    pub svvs: Vec<String>,
    pub logical_devices: Vec<String>,
    pub verbs: Vec<String>,
    pub device_types: Vec<String>,
    /// Code modules that were downloaded.
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
    /// Declarations of its struct types by name.
    pub types: Option<IndexMap<String, String>>,
    /// Remark about the module.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}
