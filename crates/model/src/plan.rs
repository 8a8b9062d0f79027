// SPDX-License-Identifier: Apache-2.0
//! Plans: a verb with its arguments, flattened, placed, bound and checked. The supervisor and the kernels run plans.
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
    /// Private to the instance: a `cells` entry of the verb, a local cell of a graph, or filled in where nothing named it.
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
    /// First value at each start (private, constant), in bytes.
    pub initial: Vec<u8>,
    /// The blocks and items of this plan that write and read it.
    pub writers: Vec<(BlockIndex, usize)>,
    pub readers: Vec<(BlockIndex, usize)>,
}

/// Binding of a port or device item.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedBinding"))]
pub enum Binding {
    Cell(CellIndex),
    /// An array port bound to one cell for each element: a gather or scatter step unless the cells lie in order.
    Cells(Vec<CellIndex>),
}

/// Relation of an input to its writer, after relaxing.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedPort"))]
pub struct Bound {
    pub item: usize,
    pub binding: Binding,
    /// Mode in force.
    pub mode: Mode,
    /// Number of values that a history input reads; else 0.
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
    /// Blocks of this plan in the same source whose outputs it takes synchronously.
    pub drivers: Vec<BlockIndex>,
    /// SVVs that it takes synchronously (or by ratio) from writers outside this plan: (item, SVV name).
    pub external_drivers: Vec<(usize, String)>,
    /// Blocks of this plan in other sources whose outputs it takes synchronously.
    pub remote_drivers: Vec<BlockIndex>,
    /// The activation it belongs to (every block has one; of a block that is only executed it is never on).
    pub activation: ActivationIndex,
    pub place: Option<SourceLocation>,
}

/// Reason for which an activation is due, while it is on.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedDue"))]
pub enum Due {
    /// Due at an interval or trigger: the number of releases of its source is given where it is switched on.
    Interval,
    /// Due with these activations of the same source (behind a ratio output n: every n-th time), of this plan …
    Driven { by: Vec<(ActivationIndex, u32)> },
    /// … or when values come from other sources or other instances (see `PlannedBlock::remote_drivers`, `external_drivers`),
    /// and all of `by`.
    Queued { by: Vec<(ActivationIndex, u32)> },
}

/// Blocks of one source that are always active together at one rate: the largest such sets, so that a chain that is
/// activated as one runs as one.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedActivation {
    pub source: String,
    pub due: Due,
    pub blocks: Vec<BlockIndex>,
    pub budget_ns: Option<u64>,
    /// Its interval may be changed while it runs.
    pub tunable: bool,
    /// Rate in each command list in which it is on (list index, rate), for the relations of later instances.
    pub rates: Vec<(usize, Rate)>,
}

/// A command, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum PlannedCommand {
    Install(Vec<BlockIndex>),
    /// One invocation of each, in order: of a graph its blocks without synchronous inputs, then what they drive.
    Execute(Vec<BlockIndex>),
    /// Every `every`-th release of its source (1 for driven ones).
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
    /// Any of these block conditions (block, item).
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
    /// `None`: the list is through; the process goes on until a condition comes or nothing is active.
    pub wait: Option<Wait>,
    /// Activations that are on after the commands of this stage: (activation, every).
    pub active: Vec<(ActivationIndex, u32)>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedList {
    pub name: String,
    pub stages: Vec<PlannedStage>,
    /// τ(this, condition) = list: indices.
    pub transitions: Vec<(usize, usize)>,
    /// Conditions that end the verb here, since it is ending already, and would lead on otherwise.
    #[serde(skip)]
    pub cut: Vec<usize>,
    /// The list of which this is the copy that runs while the verb is ending.
    #[serde(skip)]
    pub copy_of: Option<usize>,
}

/// A termination condition, resolved. The eight system conditions are there after those of the verb, if the verb does not name them.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedCondition {
    pub name: String,
    /// (block, item) of the block conditions that it stands for; empty for a system condition.
    pub on: Vec<(BlockIndex, usize)>,
    /// ν: indices into `outputs`.
    pub returns: Vec<usize>,
    /// Its end is normal: no exception (`completed`; `returns` and no `raises`).
    pub normal: bool,
    pub priority: i32,
    /// Lists to which it is limited; empty: all. Conditions of one name have no list in common.
    pub during: Vec<usize>,
    /// Code of the alarm that it raises.
    pub alarm: Option<String>,
}

impl PlannedCondition {
    /// Returns true if it is a termination condition of a list.
    pub fn holds_in(&self, list: usize) -> bool {
        self.during.is_empty() || self.during.contains(&list)
    }

    /// Returns the same condition, which holds in the copy of a list if it holds in the list.
    pub(crate) fn with_copies(&self, lists: &[PlannedList]) -> PlannedCondition {
        let mut all = self.clone();
        let copies = lists.iter().enumerate().filter(|(_, list)| list.copy_of.is_some_and(|of| self.during.contains(&of)));
        all.during.extend(copies.map(|(at, _)| at));
        all
    }
}

/// A place that a value is stored in or read from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedTarget"))]
pub enum Target {
    /// The object bound to a port.
    Cell(CellIndex),
    /// The value of a parameter or preset.
    Item { block: BlockIndex, item: usize },
    /// The value that a condition reported last.
    Report { block: BlockIndex, item: usize },
    /// Elements of an array port bound to several cells.
    Cells(Vec<CellIndex>),
}

/// Origin of an input parameter's value.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PlannedOrigin"))]
pub enum InputOrigin {
    /// Given at start.
    Given,
    /// Always its default.
    Preset,
    /// A parameter of the logical devices that are the verb's object (one value each).
    DeviceParameter { devices: Vec<String>, parameter: String },
}

/// An input parameter: ψ, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedInput {
    pub name: String,
    pub origin: InputOrigin,
    /// Normalised type, and the declarations it needs are resolved in it.
    pub type_text: String,
    pub unit: String,
    pub default: Option<Value>,
    pub tunable: bool,
    pub range: Option<PlannedRange>,
    /// The ranges of the items that it goes to.
    pub item_ranges: Vec<Range>,
    pub targets: Vec<Target>,
}

/// The range of an input parameter, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedRange {
    pub least: PlannedBound,
    pub most: PlannedBound,
    /// SVVs that the value is counted from, one for each device.
    pub counted_from: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum PlannedBound {
    Number(f64),
    /// `sign` times this parameter, of each device.
    Parameter {
        sign: f64,
        devices: Vec<String>,
        parameter: String,
    },
}

/// Property that one device must have at a start.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedRequirement {
    pub device: String,
    pub member: PlannedMember,
    /// Member that must be true for it to hold.
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

/// Course of an end, resolved.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedEnding {
    /// Index of the list that runs at the end.
    pub list: Option<usize>,
    /// Running time that it may take.
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

/// Port that becomes true, and the condition (block, item) that is waited for if its block is active.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlannedHolding {
    pub set: Target,
    pub until: (BlockIndex, usize),
}

impl PlannedSuspend {
    /// Returns true if outputs that drive on take their idle values.
    pub fn idles(&self) -> bool {
        matches!(self, PlannedSuspend::Idle | PlannedSuspend::Holding(_))
    }

    /// Returns the ways to come to rest; none if it just stops.
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

/// Remark about something that was filled in or is worth knowing: an implied cell, an edge that is a delay.
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
    /// Blocks of each source in the order of a firing: synchronous edges, then asynchronous ones where that makes no cycle,
    /// then declaration order. (`rtp.name`, blocks).
    pub order: Vec<(String, Vec<BlockIndex>)>,
    pub lists: Vec<PlannedList>,
    /// Index of the initial list.
    pub initial: usize,
    pub ending: PlannedEnding,
    pub suspend: PlannedSuspend,
    /// Action when the programming system that started it is cut off, if its verb declares one.
    pub if_cut_off: Option<IfCutOff>,
    pub conditions: Vec<PlannedCondition>,
    pub inputs: Vec<PlannedInput>,
    pub requirements: Vec<PlannedRequirement>,
    pub outputs: Vec<PlannedOutput>,
    pub claims: Vec<Claim>,
    /// Arbitration with another instance that holds it, claim by claim: as the logical device that it belongs to declares.
    pub arbitration: Vec<Arbitration>,
    /// Logical devices that must be enabled.
    pub devices: Vec<String>,
    /// True if it may be started in manual mode.
    pub manual: bool,
    pub remarks: Vec<Remark>,
}
