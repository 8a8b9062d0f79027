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
    /// Private to the instance: a `cells` entry of the verb, a local cell of a graph, or a cell created for an unnamed port.
    Private { name: String },
    /// An input with a default or a constant and no other binding.
    Constant { name: String },
    /// A channel of a physical device (index into the device's channels).
    Channel { device: String, channel: usize, write: bool },
}

/// Data object of the instance.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedCell {
    pub kind: CellKind,
    /// Normalised type.
    pub type_text: String,
    pub size: usize,
    pub align: usize,
    pub unit: String,
    /// Bytes with which a private or constant cell is initialised at each start.
    pub initial: Vec<u8>,
    /// Blocks of this plan, with their items, that write and read the cell.
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

/// Relation of an input to its writer after modes have been relaxed.
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

/// Subroutine instance: a block of a verb with its ports, parameters and source.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedBlock {
    /// Flat label: `servo.pid`.
    pub label: String,
    /// Function block, as `module.block`.
    pub block: String,
    /// Source of the block, as `rtp.name`.
    pub source: String,
    /// Size n of a sized block.
    pub size: Option<u32>,
    /// Values of parameters, presets and sizes that differ from the block's defaults: item → bytes.
    pub values: Vec<(usize, Vec<u8>)>,
    pub bindings: Vec<Bound>,
    /// Blocks of this plan on the same source that drive the block's synchronous inputs.
    pub drivers: Vec<BlockIndex>,
    /// SVVs, written outside this plan, that drive the block's synchronous or ratio inputs: (item, SVV name).
    pub external_drivers: Vec<(usize, String)>,
    /// Blocks of this plan on other sources that drive the block's synchronous inputs.
    pub remote_drivers: Vec<BlockIndex>,
    /// Activation to which the block belongs. Every block has one; the activation of a block that is only executed is never active.
    pub activation: ActivationIndex,
    pub place: Option<SourceLocation>,
}

/// Reason for which an active activation becomes due.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedDue"))]
pub enum Due {
    /// Due at an interval or on a trigger: every n-th release of its source, where n is set by the command that activates it.
    Interval,
    /// Due together with these activations of this plan on the same source; every n-th time if the driving output is a ratio output n.
    Driven { by: Vec<(ActivationIndex, u32)> },
    /// Due when values arrive from other sources or other instances (see `PlannedBlock::remote_drivers`, `external_drivers`), and all of
    /// `by` are due.
    Queued { by: Vec<(ActivationIndex, u32)> },
}

/// Blocks on one source that are always active together at the same rate. The sets are maximal, so that a chain that is activated as one
/// also runs as one.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedActivation {
    pub source: String,
    pub due: Due,
    pub blocks: Vec<BlockIndex>,
    pub budget_ns: Option<u64>,
    /// True if the interval may be changed while it is active.
    pub tunable: bool,
    /// Rates at which it is active, as (index of the command list, rate). They determine how inputs of later instances relate to its
    /// outputs.
    pub rates: Vec<(usize, Rate)>,
}

/// Command of a list, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum PlannedCommand {
    Install(Vec<BlockIndex>),
    /// Executes one invocation of each block, in order; for a graph, its blocks without synchronous inputs, followed by the blocks that
    /// they drive.
    Execute(Vec<BlockIndex>),
    /// Switches on an activation, which is then due at every `every`-th release of its source (1 if driven).
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
    /// Waits until this running time has elapsed since the stage began.
    Time(i64),
    /// Waits until no instance is active.
    Idle,
}

/// Section of a command list, up to the next wait or the end of the list.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedStage {
    pub commands: Vec<PlannedCommand>,
    /// Wait that ends the stage; `None` at the end of the list. The process then continues until a condition occurs or no instance is
    /// active.
    pub wait: Option<Wait>,
    /// Activations that are active after the commands of this stage: (activation, every).
    pub active: Vec<(ActivationIndex, u32)>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedList {
    pub name: String,
    pub stages: Vec<PlannedStage>,
    /// τ(this list, condition) = list, as indices.
    pub transitions: Vec<(usize, usize)>,
    /// Conditions that would lead from this list to another one, but end the verb instead because it is already ending.
    #[serde(skip)]
    pub cut: Vec<usize>,
    /// Original of this list, if this is the copy that runs while the verb is ending.
    #[serde(skip)]
    pub copy_of: Option<usize>,
}

/// A termination condition, resolved. The eight system conditions follow those of the verb unless the verb lists them itself.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedCondition {
    pub name: String,
    /// Block conditions that make up this condition, as (block, item); empty for a system condition.
    pub on: Vec<(BlockIndex, usize)>,
    /// ν: indices into `outputs`.
    pub returns: Vec<usize>,
    /// True if the end is normal, that is, raises no exception: `completed`, or a condition that has `returns` and no `raises`.
    pub normal: bool,
    pub priority: i32,
    /// Lists in which the condition holds; if empty, all. Conditions with the same name have no list in common.
    pub during: Vec<usize>,
    /// Code of the alarm that the condition raises.
    pub alarm: Option<String>,
}

impl PlannedCondition {
    /// Returns true if the condition holds in a list.
    pub fn holds_in(&self, list: usize) -> bool {
        self.during.is_empty() || self.during.contains(&list)
    }

    /// Returns the condition, extended to the copies of the lists in which it holds.
    pub(crate) fn with_copies(&self, lists: &[PlannedList]) -> PlannedCondition {
        let mut all = self.clone();
        let copies = lists.iter().enumerate().filter(|(_, list)| list.copy_of.is_some_and(|of| self.during.contains(&of)));
        all.during.extend(copies.map(|(at, _)| at));
        all
    }
}

/// Storage to which a value is written or from which it is read.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedTarget"))]
pub enum Target {
    /// Data object that is bound to a port.
    Cell(CellIndex),
    /// Value of a parameter or preset.
    Item { block: BlockIndex, item: usize },
    /// Value that a condition most recently reported.
    Report { block: BlockIndex, item: usize },
    /// Elements of an array port that is bound to several cells.
    Cells(Vec<CellIndex>),
}

/// Origin of an input parameter's value.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedOrigin"))]
pub enum InputOrigin {
    /// Passed to the start.
    Given,
    /// Always the default.
    Preset,
    /// Taken from a parameter of the logical devices that are passed as the verb's object, one value per device.
    DeviceParameter { devices: Vec<String>, parameter: String },
}

/// An input parameter: ψ, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedInput {
    pub name: String,
    pub origin: InputOrigin,
    /// Normalised type with all struct declarations expanded.
    pub type_text: String,
    pub unit: String,
    pub default: Option<Value>,
    pub tunable: bool,
    pub range: Option<PlannedRange>,
    /// Ranges of the items in which the value is stored.
    pub item_ranges: Vec<Range>,
    pub targets: Vec<Target>,
}

/// Range of an input parameter, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedRange {
    pub least: PlannedBound,
    pub most: PlannedBound,
    /// SVVs to which the value is relative, one per device.
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

/// Property that one device must have when the verb starts.
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

/// Ending behaviour of the verb, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedEnding {
    /// Index of the ending list.
    pub list: Option<usize>,
    /// Limit on the ending list's running time, ns.
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

/// Port that is set to true, and the condition (block, item) to wait for if its block is active.
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

    /// Returns the holdings that bring the instance to rest; empty if it needs none.
    pub fn holdings(&self) -> &[PlannedHolding] {
        match self {
            PlannedSuspend::Holding(holdings) => holdings,
            _ => &[],
        }
    }
}

/// Object that a start claims.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedClaim"))]
pub enum Claim {
    Svv { id: SvvId, name: String },
    Channel { device: String, channel: usize },
}

/// A remark about an implicit addition or another noteworthy fact, for example an implied cell or an edge that causes a delay.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Remark {
    pub text: String,
    pub place: Option<SourceLocation>,
}

/// A verb with its arguments, ready for installation.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Plan {
    pub verb: String,
    pub blocks: Vec<PlannedBlock>,
    pub cells: Vec<PlannedCell>,
    pub activations: Vec<PlannedActivation>,
    /// Blocks of each source in firing order, as (`rtp.name`, blocks). The order is determined by synchronous edges, then by asynchronous
    /// ones unless they form a cycle, then by declaration order.
    pub order: Vec<(String, Vec<BlockIndex>)>,
    pub lists: Vec<PlannedList>,
    /// Index of the initial list.
    pub initial: usize,
    pub ending: PlannedEnding,
    pub suspend: PlannedSuspend,
    /// Reaction of the instance when the programming system that started it is cut off, if its verb declares one.
    pub if_cut_off: Option<IfCutOff>,
    pub conditions: Vec<PlannedCondition>,
    pub inputs: Vec<PlannedInput>,
    pub requirements: Vec<PlannedRequirement>,
    pub outputs: Vec<PlannedOutput>,
    pub claims: Vec<Claim>,
    /// Arbitration with another holder, for each claim, as declared by the logical device to which the claimed object belongs.
    pub arbitration: Vec<Arbitration>,
    /// Logical devices that must be enabled.
    pub devices: Vec<String>,
    /// True if the verb may be started in manual mode.
    pub manual: bool,
    pub remarks: Vec<Remark>,
}
