// SPDX-License-Identifier: Apache-2.0
//! Definitions as the programming system sends them: graphs, verbs, logical device types. They are plain values with a JSON
//! representation.
//!
//! Names of ports, conditions and parameters have the format `label.item`; inside a graph or verb that is used as a block,
//! `label.inner.item`.
mod devices;
pub(crate) mod written;

pub use devices::{Application, Arbitration, Argument, DeviceParameter, DeviceType, Initial, SvvSpecification, Within};

use crate::interface::Mode;
use crate::refusal::{Class, SourceLocation};
use crate::value::Value;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// Source of a block: a subroutine or a graph. JSON: `{"subroutine": "library.pid"}` or `{"graph": {…}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum BlockSource {
    /// Subroutine, as `module.block`.
    Subroutine(String),
    Graph(Box<Graph>),
}

/// One use of a block in a graph or verb.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BlockUse {
    #[serde(deserialize_with = "crate::definition::written::one")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::ShortForm<BlockSource>"))]
    pub block: BlockSource,
    /// Constants for parameters, presets, sizes and inputs of this block (`code.biquad(b0=0.1)`).
    #[serde(default)]
    pub constants: IndexMap<String, Value>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// A data flow graph (f, I, O, L, ρ): `inputs`, `outputs` and `cells` are ρ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Graph {
    pub name: String,
    #[serde(default)]
    pub doc: String,
    #[serde(deserialize_with = "crate::definition::written::map")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::WrittenMap<BlockUse>"))]
    pub blocks: IndexMap<String, BlockUse>,
    #[serde(default, deserialize_with = "crate::definition::written::sets")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Sets"))]
    pub inputs: IndexMap<String, Vec<String>>,
    #[serde(default, deserialize_with = "crate::definition::written::sets")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Sets"))]
    pub outputs: IndexMap<String, Vec<String>>,
    #[serde(default, deserialize_with = "crate::definition::written::sets")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Sets"))]
    pub cells: IndexMap<String, Vec<String>>,
    /// Relaxed modes: port → mode.
    #[serde(default)]
    pub modes: IndexMap<String, Mode>,
    /// `divide={"estimator": 5}`: the block runs with period 5 T if the graph is activated with period T.
    #[serde(default)]
    pub divide: IndexMap<String, u32>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// An object of a verb: one logical device or, with `each`, several of the same type.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Object {
    pub device_type: String,
    #[serde(default)]
    pub each: bool,
}

/// An input parameter: ψ.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InputParameter {
    #[serde(deserialize_with = "crate::definition::written::one_or_several")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
    pub targets: Vec<String>,
    #[serde(default)]
    pub default: Option<Value>,
    #[serde(default)]
    pub tunable: bool,
    /// True if the default is used at every start and no call can override it (`preset=` of a composition).
    #[serde(default)]
    pub preset: bool,
    #[serde(default)]
    pub unit: String,
    /// Minimum and maximum, checked before a start.
    #[serde(default)]
    pub within: Option<(Bound, Bound)>,
    /// SVV of an object relative to which the value is given (`arm.commanded`, for a relative goal); the range applies to their sum.
    #[serde(default)]
    pub counted_from: Option<String>,
    /// Attribute of an object, such as `arm.chain`, that the PS reads if a call omits the input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub member: Option<String>,
    /// Name of the PS function that converts user input to the value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<String>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// Bound of the range of an input parameter. JSON: a number, `"arm.max_speed"` or `"-arm.max_speed"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Bound {
    Number(f64),
    /// Parameter of an object, negated if preceded by a minus sign. If there are several devices, each uses its own parameter.
    Member(String),
}

/// Property that each device of an object must have when a verb starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Requirement {
    /// Parameter or SVV, such as `arm.needs_home`; the requirement applies only to devices for which it is true.
    #[serde(default)]
    pub when: Option<String>,
    /// Class of the refusal if the requirement is not met.
    pub raises: Class,
    #[serde(default)]
    pub remedy: String,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// A function block command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "command", rename_all = "snake_case")]
pub enum Command {
    /// Initialises the state of these blocks.
    Install {
        #[serde(deserialize_with = "crate::definition::written::one_or_several")]
        #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
        blocks: Vec<String>,
    },
    Execute {
        block: String,
    },
    /// Activates a block. `every_ns` is absent if the block is data-driven or runs on the trigger of its source.
    Activate {
        block: String,
        #[serde(default)]
        every_ns: Option<u64>,
        /// True if the interval may be changed while the verb is running.
        #[serde(default)]
        tunable: bool,
        #[serde(default)]
        budget_ns: Option<u64>,
    },
    Deactivate {
        block: String,
    },
    /// Waits for `conditions` (block conditions `label.item`, or names of termination conditions), for a time, or, if neither is set,
    /// until no instance is active.
    Wait {
        #[serde(default, deserialize_with = "crate::definition::written::one_or_several")]
        #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
        conditions: Vec<String>,
        #[serde(default)]
        time_ns: Option<i64>,
    },
    /// `gpac.ready()`: enabling is complete when the list reaches this command.
    Ready,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CommandList {
    #[serde(deserialize_with = "crate::definition::written::commands")]
    #[cfg_attr(feature = "schema", schemars(with = "Vec<crate::definition::written::WrittenCommand>"))]
    pub commands: Vec<Command>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// A termination condition: an element of t_V with its ν.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Termination {
    /// Block conditions (`label.item`) that make up this condition; if empty, the system condition with the same name.
    #[serde(default, deserialize_with = "crate::definition::written::one_or_several")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
    pub on: Vec<String>,
    /// ν: outputs that the condition returns; absent if none is declared.
    #[serde(default, deserialize_with = "crate::definition::written::perhaps_several")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<crate::definition::written::Names>"))]
    pub returns: Option<Vec<String>>,
    /// True if the condition raises an exception in the PS. In JSON, may also be the name of the exception class, which only the PS
    /// resolves.
    #[serde(default, deserialize_with = "crate::definition::written::raised")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::RaiseMark"))]
    pub raises: bool,
    /// Command lists in which the condition holds (in JSON, one name or several); if empty, all.
    #[serde(default, deserialize_with = "crate::definition::written::one_or_several")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
    pub during: Vec<String>,
    #[serde(default)]
    pub priority: i32,
    /// Code of the alarm that the condition raises whenever it occurs, whether or not the verb ends.
    #[serde(default)]
    pub alarm: Option<String>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// Transition of τ: the list to which a condition leads from another list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Transition {
    pub from: String,
    pub condition: String,
    pub to: String,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// A part of a composed verb.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Part {
    /// Name of the verb from which the part was created.
    pub verb: String,
    /// Command list of the composed verb with which the part begins.
    pub initial: String,
}

/// A verb (f_V, p_V, o_V, inst_V, χ, ψ, ω, c_V, t_V, τ, ν).
///
/// In a composed verb (one with `parts`), blocks, cells and lists carry the label of their part (`close.start`). So do the keys of
/// `conditions` and `output_values`, which may then have one entry per part; [`Verb::reported`] returns their names in reports and τ.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Verb {
    pub name: String,
    #[serde(default)]
    pub doc: String,
    /// True if the verb may be started in manual mode.
    #[serde(default)]
    pub manual: bool,
    #[serde(deserialize_with = "crate::definition::written::map")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::WrittenMap<BlockUse>"))]
    pub blocks: IndexMap<String, BlockUse>,
    #[serde(default, deserialize_with = "crate::definition::written::map")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::WrittenMap<Object>"))]
    pub objects: IndexMap<String, Object>,
    /// χ: parameter (`sensed`, `drive.position`, `arm.commanded`) → data nodes.
    #[serde(default, deserialize_with = "crate::definition::written::sets")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Sets"))]
    pub instantiation_parameters: IndexMap<String, Vec<String>>,
    /// Private SVVs of each instance; part of χ.
    #[serde(default, deserialize_with = "crate::definition::written::sets")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Sets"))]
    pub cells: IndexMap<String, Vec<String>>,
    #[serde(default, deserialize_with = "crate::definition::written::map")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::WrittenMap<InputParameter>"))]
    pub input_parameters: IndexMap<String, InputParameter>,
    /// Boolean members of objects (SVVs or parameters) that must be true when the verb starts: `arm.homed`.
    #[serde(default, deserialize_with = "crate::definition::written::map")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::WrittenMap<Requirement>"))]
    pub requires: IndexMap<String, Requirement>,
    /// ω.
    #[serde(default)]
    pub output_values: IndexMap<String, String>,
    #[serde(deserialize_with = "crate::definition::written::lists")]
    #[cfg_attr(feature = "schema", schemars(with = "IndexMap<String, crate::definition::written::WrittenList>"))]
    pub command_lists: IndexMap<String, CommandList>,
    #[serde(default)]
    pub initial: Option<String>,
    #[serde(default, deserialize_with = "crate::definition::written::map")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::WrittenMap<Termination>"))]
    pub conditions: IndexMap<String, Termination>,
    #[serde(default)]
    pub transitions: Vec<Transition>,
    /// Relaxed modes: port → mode.
    #[serde(default)]
    pub modes: IndexMap<String, Mode>,
    /// Parts of a composed verb by label, including nested parts (`pick.approach`). Empty if the verb is not composed.
    #[serde(default)]
    pub parts: IndexMap<String, Part>,
    /// Command list that runs at every end (brakes, a ramp down), except after an emergency stop, the loss of a processor or a second
    /// halt.
    #[serde(default)]
    pub ending: Option<String>,
    /// Time limit, ns, for an ending list, for the lists to which τ leads after a device was disabled or after an abort, and for a
    /// suspension that waits for its condition; if absent, [`ENDING_LIMIT_NS`].
    #[serde(default)]
    pub ending_limit_ns: Option<i64>,
    #[serde(default)]
    pub suspend: Suspend,
    /// Reaction of a running instance when the programming system that started it is cut off; if absent, an action is halted, and a
    /// logical device's own verb continues.
    #[serde(default)]
    pub if_cut_off: Option<IfCutOff>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

impl Verb {
    /// Returns the name, in reports and τ, of the condition or output value with this key: in a composed verb, the key without the label
    /// of its part.
    pub fn reported<'a>(&self, key: &'a str) -> &'a str {
        if self.parts.is_empty() { key } else { key.rsplit('.').next().unwrap_or(key) }
    }

    /// Returns the name of the command list with which a start begins; `None` if the verb does not declare one.
    pub fn initial_list(&self) -> Option<&str> {
        let mut begins = self.command_lists.keys().map(String::as_str).filter(|name| self.ending.as_deref() != Some(*name));
        match (&self.initial, begins.next(), begins.next()) {
            (Some(name), ..) => Some(name),
            (None, Some(only), None) => Some(only),
            _ => None,
        }
    }
}

/// Default of `ending_limit`: 10 s.
pub const ENDING_LIMIT_NS: i64 = 10_000_000_000;

/// Suspension of a verb. JSON: `"idle"`, `"hold"`, `"hold_last"`, `"safe"`, or `{"holding": [{"set": "label.input", "until":
/// "label.condition"}]}`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Suspend {
    /// Driving outputs take their idle values; all other outputs keep their last commands.
    #[default]
    Idle,
    /// All outputs keep their last commands; refused if one of them is a driving output.
    Hold,
    /// All outputs keep their last commands, including driving outputs.
    HoldLast,
    /// Output channels that the verb writes take their safe values for the duration of the suspension.
    Safe,
    /// The blocks first come to rest. A composed verb has one entry for each part that declares one.
    Holding(Vec<Holding>),
}

/// Reaction of a running verb instance when the programming system that started it dies or becomes unreachable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum IfCutOff {
    /// The instance continues as if nothing had happened.
    Continue,
    /// The instance is halted: it follows τ on `halted`, or runs its ending list.
    Halt,
    /// The outputs of the instance's devices take their safe values immediately, and the instance ends with `aborted`.
    Safe,
}

/// Sets `set`, a Boolean input or parameter, to true; the verb stops when the condition `until` occurs. Resuming clears `set`. Applies in
/// the command lists in which the block of `until` is active.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Holding {
    pub set: String,
    pub until: String,
}
