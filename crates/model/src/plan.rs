// SPDX-License-Identifier: Apache-2.0
//! Plans: a verb with its arguments, flattened, placed, bound and checked. The supervisor and the kernels execute plans.
use crate::configuration::{Rate, SvvId};
use crate::definition::{Arbitration, IfCutOff};
use crate::interface::Mode;
use crate::range::Range;
use crate::refusal::{Class, SourceLocation};
use crate::value::Value;
use serde::Serialize;

/// Index of a block in [`Plan::blocks`].
pub type BlockIndex = usize;
/// Index of a cell in [`Plan::cells`].
pub type CellIndex = usize;
/// Index of an activation in [`Plan::activations`].
pub type ActivationIndex = usize;

/// Kind of a cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedCellKind"))]
pub enum CellKind {
    /// An SVV of the system or a device.
    Svv { id: SvvId, name: String },
    /// Private to the instance: a `cells` entry of the verb, a local cell of a graph, or a cell added for an unnamed port.
    Private { name: String },
    /// An input with a default or a constant that nothing else binds.
    Constant { name: String },
    /// A channel of a physical device (index into the device's channels).
    Channel { device: String, channel: usize, write: bool },
}

/// One data object of the instance.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedCell {
    pub kind: CellKind,
    /// Normalised type.
    pub type_text: String,
    pub size: usize,
    pub align: usize,
    pub unit: String,
    /// Value at each start (private, constant), in bytes.
    pub initial: Vec<u8>,
    /// Blocks and items of this plan that write and read the cell.
    pub writers: Vec<(BlockIndex, usize)>,
    pub readers: Vec<(BlockIndex, usize)>,
}

/// Binding of a port or device item.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedBinding"))]
pub enum Binding {
    Cell(CellIndex),
    /// An array port bound to one cell per element, with a gather or scatter step unless the cells are contiguous.
    Cells(Vec<CellIndex>),
}

/// Relation of an input to its writer, after relaxing.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedPort"))]
pub struct Bound {
    pub item: usize,
    pub binding: Binding,
    /// Effective mode.
    pub mode: Mode,
    /// Number of values that a history input reads; otherwise 0.
    pub history: u32,
}

/// One subroutine instance.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedBlock {
    /// Flat label: `servo.pid`.
    pub label: String,
    /// `module.block`.
    pub block: String,
    /// `rtp.name`.
    pub source: String,
    /// n of a sized block.
    pub size: Option<u32>,
    /// Values of parameters, presets and sizes that differ from the block's defaults: item → bytes.
    pub values: Vec<(usize, Vec<u8>)>,
    pub bindings: Vec<Bound>,
    /// Blocks of this plan in the same source that drive its synchronous inputs.
    pub drivers: Vec<BlockIndex>,
    /// SVVs from writers outside this plan that drive its synchronous or ratio inputs: (item, SVV name).
    pub external_drivers: Vec<(usize, String)>,
    /// Blocks of this plan in other sources that drive its synchronous inputs.
    pub remote_drivers: Vec<BlockIndex>,
    /// Activation that the block belongs to. Every block has one; the activation of a block that is only executed is never on.
    pub activation: ActivationIndex,
    pub place: Option<SourceLocation>,
}

/// Reason for which an activation that is on becomes due.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedDue"))]
pub enum Due {
    /// Due at an interval or trigger: the command that switches it on sets the number of releases of its source.
    Interval,
    /// Due with these activations of this plan in the same source (behind a ratio output n: every n-th time).
    Driven { by: Vec<(ActivationIndex, u32)> },
    /// Due when values arrive from other sources or other instances (see `PlannedBlock::remote_drivers`, `external_drivers`), and all of
    /// `by` are due.
    Queued { by: Vec<(ActivationIndex, u32)> },
}

/// Blocks of one source that are always active together at one rate. The sets are maximal, so that a chain that is activated as one also
/// runs as one.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedActivation {
    pub source: String,
    pub due: Due,
    pub blocks: Vec<BlockIndex>,
    pub budget_ns: Option<u64>,
    /// True if the interval may be changed while the activation is on.
    pub tunable: bool,
    /// Rates in the command lists in which the activation is on (list index, rate), for the relations of later instances.
    pub rates: Vec<(usize, Rate)>,
}

/// A command, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum PlannedCommand {
    Install(Vec<BlockIndex>),
    /// One invocation of each block, in order; for a graph, its blocks without synchronous inputs, followed by the blocks they drive.
    Execute(Vec<BlockIndex>),
    /// Switches an activation on, at every `every`-th release of its source (1 for driven ones).
    On {
        activation: ActivationIndex,
        every: u32,
    },
    Off(ActivationIndex),
    Ready,
}

/// End of a stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedWait"))]
pub enum Wait {
    /// Waits for any of these block conditions (block, item).
    Conditions(Vec<(BlockIndex, usize)>),
    /// Running time since the stage began.
    Time(i64),
    /// Wait until no instance is active.
    Idle,
}

/// Section of a command list up to a wait.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedStage {
    pub commands: Vec<PlannedCommand>,
    /// `None` at the end of the list: the process continues until a condition occurs or nothing is active.
    pub wait: Option<Wait>,
    /// Activations that are on after the commands of this stage: (activation, every).
    pub active: Vec<(ActivationIndex, u32)>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedList {
    pub name: String,
    pub stages: Vec<PlannedStage>,
    /// τ(this list, condition) = list, as indices.
    pub transitions: Vec<(usize, usize)>,
    /// Conditions that end the verb in this list because it is already ending, and that would otherwise lead to another list.
    #[serde(skip)]
    pub cut: Vec<usize>,
    /// Original of this list, if this is the copy that runs while the verb is ending.
    #[serde(skip)]
    pub copy_of: Option<usize>,
}

/// A termination condition, resolved. The eight system conditions follow those of the verb unless the verb names them.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedCondition {
    pub name: String,
    /// Block conditions that it consists of, as (block, item); empty for a system condition.
    pub on: Vec<(BlockIndex, usize)>,
    /// ν: indices into `outputs`.
    pub returns: Vec<usize>,
    /// True if the end is normal: no exception (`completed`; `returns` and no `raises`).
    pub normal: bool,
    pub priority: i32,
    /// Lists in which it holds; empty: all. Conditions of the same name have no list in common.
    pub during: Vec<usize>,
    /// Code of the alarm that it raises.
    pub alarm: Option<String>,
}

impl PlannedCondition {
    /// Returns true if the condition holds in a list.
    pub fn holds_in(&self, list: usize) -> bool {
        self.during.is_empty() || self.during.contains(&list)
    }

    /// Returns the condition extended to the copies of the lists in which it holds.
    pub(crate) fn with_copies(&self, lists: &[PlannedList]) -> PlannedCondition {
        let mut all = self.clone();
        let copies = lists.iter().enumerate().filter(|(_, list)| list.copy_of.is_some_and(|of| self.during.contains(&of)));
        all.during.extend(copies.map(|(at, _)| at));
        all
    }
}

/// Storage that a value is written to or read from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedTarget"))]
pub enum Target {
    /// Data object bound to a port.
    Cell(CellIndex),
    /// Value of a parameter or preset.
    Item { block: BlockIndex, item: usize },
    /// Value that a condition reported last.
    Report { block: BlockIndex, item: usize },
    /// Elements of an array port bound to several cells.
    Cells(Vec<CellIndex>),
}

/// Origin of an input parameter's value.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedOrigin"))]
pub enum InputOrigin {
    /// Passed at the start.
    Given,
    /// Always its default.
    Preset,
    /// Taken from a parameter of the logical devices that are the verb's object (one value each).
    DeviceParameter { devices: Vec<String>, parameter: String },
}

/// An input parameter: ψ, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedInput {
    pub name: String,
    pub origin: InputOrigin,
    /// Normalised type, with all struct declarations expanded.
    pub type_text: String,
    pub unit: String,
    pub default: Option<Value>,
    pub tunable: bool,
    pub range: Option<PlannedRange>,
    /// Ranges of the items that the value is stored in.
    pub item_ranges: Vec<Range>,
    pub targets: Vec<Target>,
}

/// The range of an input parameter, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedRange {
    pub least: PlannedBound,
    pub most: PlannedBound,
    /// SVVs that the value is relative to, one per device.
    pub counted_from: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum PlannedBound {
    Number(f64),
    /// `sign` times this parameter of each device.
    Parameter {
        sign: f64,
        devices: Vec<String>,
        parameter: String,
    },
}

/// A property that one device must have at a start.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedRequirement {
    pub device: String,
    pub member: PlannedMember,
    /// Member that must be true for the requirement to apply.
    pub when: Option<PlannedMember>,
    pub raises: Class,
    pub remedy: String,
}

/// A member of a logical device.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum PlannedMember {
    /// Name of the SVV.
    Svv(String),
    Parameter {
        device: String,
        parameter: String,
    },
}

/// An output value: ω, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedOutput {
    pub name: String,
    pub type_text: String,
    pub target: Target,
}

/// Ending of the verb, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedEnding {
    /// Index of the ending list.
    pub list: Option<usize>,
    /// Limit of its running time.
    pub limit_ns: i64,
}

/// Suspension of the instance, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum PlannedSuspend {
    Idle,
    Hold,
    HoldLast,
    Safe,
    Holding(Vec<PlannedHolding>),
}

/// Port that is set to true, and the condition (block, item) that is awaited if its block is active.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedHolding {
    pub set: Target,
    pub until: (BlockIndex, usize),
}

impl PlannedSuspend {
    /// Returns true if driving outputs take their idle values.
    pub fn idles(&self) -> bool {
        matches!(self, PlannedSuspend::Idle | PlannedSuspend::Holding(_))
    }

    /// Returns the holdings by which the instance comes to rest; empty if it just stops.
    pub fn holdings(&self) -> &[PlannedHolding] {
        match self {
            PlannedSuspend::Holding(holdings) => holdings,
            _ => &[],
        }
    }
}

/// An object that a start claims.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedClaim"))]
pub enum Claim {
    Svv { id: SvvId, name: String },
    Channel { device: String, channel: usize },
}

/// A remark about an implicit addition or another noteworthy fact: an implied cell, an edge that is a delay.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Remark {
    pub text: String,
    pub place: Option<SourceLocation>,
}

/// A verb with its arguments, ready to be installed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Plan {
    pub verb: String,
    pub blocks: Vec<PlannedBlock>,
    pub cells: Vec<PlannedCell>,
    pub activations: Vec<PlannedActivation>,
    /// Blocks of each source in firing order: by synchronous edges, then by asynchronous ones unless they form a cycle, then by
    /// declaration order. (`rtp.name`, blocks).
    pub order: Vec<(String, Vec<BlockIndex>)>,
    pub lists: Vec<PlannedList>,
    /// Index of the initial list.
    pub initial: usize,
    pub ending: PlannedEnding,
    pub suspend: PlannedSuspend,
    /// Reaction when the programming system that started it is cut off, if its verb declares one.
    pub if_cut_off: Option<IfCutOff>,
    pub conditions: Vec<PlannedCondition>,
    pub inputs: Vec<PlannedInput>,
    pub requirements: Vec<PlannedRequirement>,
    pub outputs: Vec<PlannedOutput>,
    pub claims: Vec<Claim>,
    /// Arbitration with another holder, for each claim, as declared by the logical device that the claimed object belongs to.
    pub arbitration: Vec<Arbitration>,
    /// Logical devices that must be enabled.
    pub devices: Vec<String>,
    /// True if the verb may be started in manual mode.
    pub manual: bool,
    pub remarks: Vec<Remark>,
}
