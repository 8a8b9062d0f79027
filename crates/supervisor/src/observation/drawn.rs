// SPDX-License-Identifier: Apache-2.0
//! Form of the picture of what is installed, as `picture.rs` gives it.
use crate::observation::states::InstanceState;
use indexmap::IndexMap;
use model::configuration::Rate;
use model::value::Value;
use serde::Serialize;

/// Installed verb instances.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledInstances {
    pub instances: Vec<InstalledInstance>,
}

/// A verb instance with its blocks, cells, command lists, conditions and transitions.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledInstance {
    pub id: u64,
    pub name: String,
    pub verb: String,
    pub state: InstanceState,
    /// The command list that runs, or ran last.
    pub list: String,
    /// Number of the wait in its list at which it is.
    pub stage: usize,
    /// The logical device whose own verb it is.
    pub owner: Option<String>,
    /// Number of its starts.
    pub starts: u64,
    /// Its owner, or the first of the logical devices that it acts on.
    pub device: Option<String>,
    /// The logical devices that it acts on.
    pub devices: Vec<String>,
    /// The present values of its input parameters: those of its latest start with what was changed since; before the first one the
    /// defaults. Null: it has none yet.
    pub inputs: IndexMap<String, Option<Value>>,
    pub blocks: Vec<InstalledBlock>,
    pub cells: Vec<InstalledCell>,
    #[serde(flatten)]
    pub course: InstalledCourse,
}

/// Course of a verb instance: its command lists, and the transitions between them.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledCourse {
    pub lists: Vec<InstalledList>,
    pub conditions: Vec<InstalledCondition>,
    pub transitions: Vec<InstalledTransition>,
    /// The list that a start begins with.
    pub initial: String,
    /// The list that runs at its end.
    pub ending: Option<String>,
}

/// A function block instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledBlock {
    /// A block of a nested graph: `outer.inner.block`.
    pub label: String,
    /// `module.block`.
    pub block: String,
    pub doc: String,
    /// The interrupt source that runs it, `rtp.source`.
    pub source: String,
    /// Number of elements of its sized ports.
    pub size: Option<u32>,
    /// The file that it was written in; empty: not known.
    pub file: String,
    /// The interval while it is active, else that of the first list in which it is, ns; null where no timer says.
    pub every_ns: Option<u64>,
    pub ports: Vec<InstalledPort>,
    pub activation: InstalledActivation,
}

/// Activation of a block, and when it is due.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledActivation {
    /// True while it is active.
    pub on: bool,
    pub due: DueBy,
    /// Labels of the blocks that drive it.
    pub by: Vec<String>,
    /// Its rate in each command list in which it is active.
    pub rates: IndexMap<String, Rate>,
    /// Time that one invocation may take, ns.
    pub budget_ns: Option<u64>,
    /// Its interval may be changed while it runs.
    pub tunable: bool,
}

/// Reason for which an active block is due: its interval or trigger, the blocks that drive it, or values from other sources and instances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum DueBy {
    Interval,
    Driven,
    Queued,
}

/// A port, parameter, condition or device item of a block, and what it is bound to.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledPort {
    pub name: String,
    pub direction: PortDirection,
    /// The block writes it.
    pub writes: bool,
    pub type_text: String,
    pub unit: String,
    /// The mode in force: `synchronous`, `ratio 5`, `asynchronous`.
    pub mode: String,
    pub doc: String,
    /// The SVV, private cell, channel or constant that it is bound to: what `read`, `svv_about` and the stream call it.
    pub cell: Option<String>,
    /// An input without a default.
    pub required: bool,
    /// Cells of an array port that is bound to one cell for each element.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<Vec<String>>,
    /// Value of a parameter, and of an input that nothing is bound to: the one that it was made with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<PortValue>,
}

/// The value of a port that nothing is bound to, or the number of elements of a block; null where it has none.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum PortValue {
    Of(Value),
    Size(Option<u32>),
}

/// Direction of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum PortDirection {
    Input,
    Output,
    Parameter,
    Condition,
    /// A channel of a physical device, read or written.
    Device,
}

/// A data object that blocks read and write.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledCell {
    pub name: String,
    pub kind: CellKind,
    pub type_text: String,
    pub unit: String,
    /// Label and port of what writes it.
    pub writers: Vec<(String, String)>,
    /// Label and port of what reads it.
    pub readers: Vec<(String, String)>,
    /// Value of a constant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<Value>,
}

/// Kind of a data object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum CellKind {
    /// A state vector variable of the system.
    Svv,
    /// Private to a verb instance.
    Private,
    /// A constant, or the default of an input.
    Constant,
    /// A channel of a physical device.
    Channel,
}

/// A command list.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledList {
    pub name: String,
    /// Commands as a program would write them, for people to read.
    pub commands: Vec<String>,
}

/// A termination condition.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledCondition {
    pub name: String,
    /// The block conditions that it stands for, `label.condition`.
    pub of: Vec<String>,
    /// True if it is one of every verb: `halted`, `time_limit`.
    pub system: bool,
    /// Output values that it returns.
    pub returns: Vec<String>,
    /// Its end is an exception.
    pub raises: bool,
    /// The command lists in which it counts; empty: all.
    pub during: Vec<String>,
    pub priority: i32,
    /// Code of the alarm that it raises.
    pub alarm: Option<String>,
}

/// A transition: on this condition the list `to` follows the list `from`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledTransition {
    pub from: String,
    pub condition: String,
    pub to: String,
}
