// SPDX-License-Identifier: Apache-2.0
//! Definitions as the programming system gives them: graphs, verbs, logical device types. Plain values with a JSON form.
//!
//! Names of ports, conditions and parameters are `label.item`; inside a graph that is a block of a graph or verb, `label.inner.item`.
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
    /// `module.block`.
    Subroutine(String),
    Graph(Box<Graph>),
}

/// One occurrence of a block in a graph or verb.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BlockUse {
    #[serde(deserialize_with = "crate::definition::written::one")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::ShortForm<BlockSource>"))]
    pub block: BlockSource,
    /// Constants for parameters, presets, sizes and inputs of this occurrence (`code.biquad(b0=0.1)`).
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
    /// `divide={"estimator": 5}`: this block at 5 T where the graph is activated at T.
    #[serde(default)]
    pub divide: IndexMap<String, u32>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// An object of a verb: one logical device, or (`each`) several of the type.
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
    /// Its default is its value at every start; no call gives another (`preset=` of a composition).
    #[serde(default)]
    pub preset: bool,
    #[serde(default)]
    pub unit: String,
    /// Minimum and maximum value, checked before a start.
    #[serde(default)]
    pub within: Option<(Bound, Bound)>,
    /// The range is that of this SVV of an object plus the value (`arm.commanded`, for a relative goal).
    #[serde(default)]
    pub counted_from: Option<String>,
    /// Where a call leaves it out: this attribute of an object, `arm.chain`, which the PS looks up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub member: Option<String>,
    /// The function of the PS that makes the value of what people write, by its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<String>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// An end of the range of an input parameter. JSON: a number, `"arm.max_speed"` or `"-arm.max_speed"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Bound {
    Number(f64),
    /// A parameter of an object; behind a minus sign its negative. Of several devices each has its own.
    Member(String),
}

/// Property that each device of an object must have when a verb starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Requirement {
    /// Parameter (or SVV), `arm.needs_home`, that must be true for the requirement to hold of a device.
    #[serde(default)]
    pub when: Option<String>,
    /// Class of the refusal.
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
    /// Fresh state for these blocks.
    Install {
        #[serde(deserialize_with = "crate::definition::written::one_or_several")]
        #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
        blocks: Vec<String>,
    },
    Execute {
        block: String,
    },
    /// `every_ns` absent: a data-driven block, or the trigger that it is placed on.
    Activate {
        block: String,
        #[serde(default)]
        every_ns: Option<u64>,
        /// The interval may be changed while it runs.
        #[serde(default)]
        tunable: bool,
        #[serde(default)]
        budget_ns: Option<u64>,
    },
    Deactivate {
        block: String,
    },
    /// `conditions` (block conditions `label.item`, or termination condition names), or a time, or neither: until no instance is active.
    Wait {
        #[serde(default, deserialize_with = "crate::definition::written::one_or_several")]
        #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
        conditions: Vec<String>,
        #[serde(default)]
        time_ns: Option<i64>,
    },
    /// `gpac.ready()`: enabling is complete when the list comes here.
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
    /// Block conditions (`label.item`) it stands for; empty: the system condition of its own name.
    #[serde(default, deserialize_with = "crate::definition::written::one_or_several")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
    pub on: Vec<String>,
    /// ν: outputs it returns. Absent: none declared.
    #[serde(default, deserialize_with = "crate::definition::written::perhaps_several")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<crate::definition::written::Names>"))]
    pub returns: Option<Vec<String>>,
    /// True if it raises on the PS (the PS knows which class): so, or by the name of the class.
    #[serde(default, deserialize_with = "crate::definition::written::raised")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::RaiseMark"))]
    pub raises: bool,
    /// Command lists to which it is limited; empty: all. In JSON one name, or several.
    #[serde(default, deserialize_with = "crate::definition::written::one_or_several")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
    pub during: Vec<String>,
    #[serde(default)]
    pub priority: i32,
    /// Code of the alarm that it raises whenever it acts, whether the verb ends or goes on.
    #[serde(default)]
    pub alarm: Option<String>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// One line of τ.
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
    /// Name of the verb that it was made from.
    pub verb: String,
    /// The command list of the composed verb with which it begins.
    pub initial: String,
}

/// A verb (f_V, p_V, o_V, inst_V, χ, ψ, ω, c_V, t_V, τ, ν).
///
/// In a composed verb, one with `parts`, blocks, cells and lists carry the label of their part (`close.start`). So do the keys of
/// `conditions` and `output_values`, which may then hold one line for each part; what reports and τ call them is [`Verb::reported`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Verb {
    pub name: String,
    #[serde(default)]
    pub doc: String,
    /// True if it may be started in manual mode.
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
    /// Members of objects, SVVs or parameters of type bool, that must be true at a start: `arm.homed`.
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
    /// Parts of a composed verb by label, and those of its parts (`pick.approach`). Empty in one that is written whole.
    #[serde(default)]
    pub parts: IndexMap<String, Part>,
    /// The command list that runs at every end, but at an emergency stop, a lost processor and a second halt (brakes, a ramp down).
    #[serde(default)]
    pub ending: Option<String>,
    /// Running time after which an ending list, what τ leads to from a disabled device or an abort, and a suspension that waits for
    /// its condition are cut short, ns; absent: [`ENDING_LIMIT_NS`].
    #[serde(default)]
    pub ending_limit_ns: Option<i64>,
    #[serde(default)]
    pub suspend: Suspend,
    /// Action of a running instance when the programming system that started it is cut off; absent: an action is halted, the own verb
    /// of a logical device continues.
    #[serde(default)]
    pub if_cut_off: Option<IfCutOff>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

impl Verb {
    /// Returns the name in reports and τ of the condition or output value of that key: in a composed verb the part of it behind the label of its
    /// part.
    pub fn reported<'a>(&self, key: &'a str) -> &'a str {
        if self.parts.is_empty() { key } else { key.rsplit('.').next().unwrap_or(key) }
    }

    /// Returns the name of the command list that a start begins with; none if it is not given.
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

/// Suspension of a verb. JSON: `"idle"`, `"hold"`, `"hold_last"`, `"safe"`, `{"holding": [{"set": "label.input", "until": "label.condition"}]}`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Suspend {
    /// Outputs that drive on take their idle values; the last commands of all others stay where they are.
    #[default]
    Idle,
    /// The last commands stay where they are; refused where one of them drives on.
    Hold,
    /// The last commands stay where they are, those that drive on too.
    HoldLast,
    /// Output channels that the verb writes go to their safe values meanwhile.
    Safe,
    /// Its blocks come to rest first; a composed verb has a way for each part that has one.
    Holding(Vec<Holding>),
}

/// Action of a running verb instance when the programming system that started it dies or can no longer be reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum IfCutOff {
    /// The instance goes on as if nothing had happened.
    Continue,
    /// The instance is halted: τ on `halted`, its ending list.
    Halt,
    /// The outputs of its devices go to their safe values at once, and it ends with `aborted`.
    Safe,
}

/// `set`, a bool input or parameter, becomes true; when the condition `until` comes, the verb stops. Going on clears `set`. It
/// counts in the command lists in which the block of `until` is active.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Holding {
    pub set: String,
    pub until: String,
}
