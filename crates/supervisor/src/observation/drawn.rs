// SPDX-License-Identifier: Apache-2.0
//! Data structures for the picture of the installed instances, which `picture.rs` creates.
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
    /// Command list that is running or was the last to run.
    pub list: String,
    /// Index of the current wait in the list.
    pub stage: usize,
    /// Logical device whose own verb this instance runs, if any.
    pub owner: Option<String>,
    /// Number of starts.
    pub starts: u64,
    /// Owner of the instance, or else the first of the logical devices on which it acts.
    pub device: Option<String>,
    /// Logical devices on which the instance acts.
    pub devices: Vec<String>,
    /// Current values of the input parameters: those of the latest start, updated by later changes, or the defaults before the first
    /// start. Null if there is no value yet.
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
    /// List with which a start begins.
    pub initial: String,
    /// List that runs at the end.
    pub ending: Option<String>,
}

/// A function block instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledBlock {
    /// Label of the block; in a nested graph, `outer.inner.block`.
    pub label: String,
    /// Function block, as `module.block`.
    pub block: String,
    pub doc: String,
    /// Interrupt source that runs the block, `rtp.source`.
    pub source: String,
    /// Number of elements of the block's sized ports.
    pub size: Option<u32>,
    /// Source file of the block; empty if unknown.
    pub file: String,
    /// Current interval if the block is active, otherwise that of the first list that activates it, ns; null if no timer determines it.
    pub every_ns: Option<u64>,
    pub ports: Vec<InstalledPort>,
    pub activation: InstalledActivation,
}

/// Activation of a block, and the reason for which it becomes due.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledActivation {
    /// True if the activation is active.
    pub on: bool,
    pub due: DueBy,
    /// Labels of the blocks that drive the activation.
    pub by: Vec<String>,
    /// Rate in each command list in which the activation is active.
    pub rates: IndexMap<String, Rate>,
    /// Time budget of one invocation, ns.
    pub budget_ns: Option<u64>,
    /// True if the interval may be changed at run time.
    pub tunable: bool,
}

/// Reason for which an active block becomes due: its interval or trigger, the blocks that drive it, or values from other sources and
/// instances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum DueBy {
    Interval,
    Driven,
    Queued,
}

/// A port, parameter, condition or device item of a block, and its binding.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledPort {
    pub name: String,
    pub direction: PortDirection,
    /// True if the block writes the port.
    pub writes: bool,
    pub type_text: String,
    pub unit: String,
    /// Effective mode: `synchronous`, `ratio 5`, `asynchronous`.
    pub mode: String,
    pub doc: String,
    /// SVV, private cell, channel or constant to which the port is bound, by the name used in `read`, `svv_about` and the stream.
    pub cell: Option<String>,
    /// True if the port is an input without a default.
    pub required: bool,
    /// Cells of an array port that is bound to one cell per element.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<Vec<String>>,
    /// Value of a parameter or an unbound input, as set at creation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<PortValue>,
}

/// Value of an unbound port, or number of elements of a block; null if there is none.
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
    /// Labels and ports of the writers.
    pub writers: Vec<(String, String)>,
    /// Labels and ports of the readers.
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
    /// Commands in the syntax of a program, for display.
    pub commands: Vec<String>,
}

/// A termination condition.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledCondition {
    pub name: String,
    /// Block conditions that make up this condition, as `label.condition`.
    pub of: Vec<String>,
    /// True if every verb has the condition: `halted`, `time_limit`.
    pub system: bool,
    /// Output values that the condition returns.
    pub returns: Vec<String>,
    /// True if the condition ends the verb with an exception.
    pub raises: bool,
    /// Command lists in which the condition holds; if empty, all.
    pub during: Vec<String>,
    pub priority: i32,
    /// Code of the alarm that the condition raises.
    pub alarm: Option<String>,
}

/// A transition: on this condition, the list `to` follows the list `from`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InstalledTransition {
    pub from: String,
    pub condition: String,
    pub to: String,
}
