// SPDX-License-Identifier: Apache-2.0
//! Configuration of a system when a verb is applied: hardware, code, SVVs, devices, and installed instances. The supervisor maintains it;
//! the checks only read it.
use crate::definition::{Arbitration, DeviceType, Verb};
use crate::interface::{Interface, Mode};
use crate::refusal::SourceLocation;
use crate::value::Value;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SvvId(pub u32);

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SourceKind {
    Timer { period_ns: u64 },
    Trigger,
    Software,
}

/// An interrupt source; its key in [`Configuration::sources`] is `rtp.name`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Source {
    pub processor: String,
    pub kind: SourceKind,
    pub priority: u8,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Channel {
    /// Name: `part.channel` or a plain name.
    pub name: String,
    /// True if the channel is written, false if it is read.
    pub write: bool,
    pub type_text: String,
    pub unit: String,
}

/// A physical device, served by one source of its RTP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhysicalDevice {
    pub processor: String,
    /// `rtp.name` of the source that reads and writes the device.
    pub source: String,
    pub channels: Vec<Channel>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// An existing SVV.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Svv {
    pub id: SvvId,
    /// C type as declared; the struct types that it needs are in `types`.
    pub type_text: String,
    pub unit: String,
    #[serde(default)]
    pub types: IndexMap<String, String>,
    /// Number of values kept.
    #[serde(default)]
    pub history: u32,
    /// Logical device to which the SVV belongs.
    #[serde(default)]
    pub device: Option<String>,
    /// True if several devices share the SVV: it is created together with the first of them and deleted with the last.
    #[serde(default)]
    pub shared: bool,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// An existing logical device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogicalDevice {
    pub device_type: String,
    /// Member → SVV name (`arm.elbow.sensed`).
    pub svvs: IndexMap<String, String>,
    pub parameters: IndexMap<String, Value>,
    /// Additional arguments of the device's own verb (`drive`).
    pub arguments: IndexMap<String, crate::definition::Argument>,
    /// `rtp.name` of the source on which the device's own verb runs.
    #[serde(default)]
    pub source: Option<String>,
    pub enabled: bool,
    /// Unit parts that this device replaces, in order: (`rad`, `m`) for a prismatic joint.
    #[serde(default)]
    pub units: Vec<(String, String)>,
    /// Arbitration for a second verb that commands the device, if it differs from that of the type.
    #[serde(default)]
    pub arbitration: Option<Arbitration>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

impl LogicalDevice {
    /// Returns a unit declared by the type as it applies to this device.
    pub fn unit(&self, declared: &str) -> String {
        self.units.iter().fold(declared.to_owned(), |unit, (from, to)| unit.replace(from.as_str(), to))
    }
}

/// Rate at which a writer updates in one command list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Rate {
    /// Updates every `period_ns` of the timers of one host (all timers of a host share its epoch).
    Interval { period_ns: u64 },
    /// Updates at every n-th trigger of this source.
    Trigger { source: String, every: u32 },
    /// Updates only when executed by `execute`.
    Once,
}

/// A current writer of an SVV: a port of an installed instance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Writer {
    /// Verb instance, for example `joint_servo#2`.
    pub instance: String,
    /// Flat label and port, for example `read.y`.
    pub port: String,
    /// Source of the writer, as `rtp.name`.
    pub source: String,
    pub mode: Mode,
    /// Rates of the writer in the command lists of its verb.
    pub rates: Vec<Rate>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// All information that the checks may need.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Configuration {
    pub processors: Vec<String>,
    /// `rtp.name` → source, in creation order.
    pub sources: IndexMap<String, Source>,
    pub devices: IndexMap<String, PhysicalDevice>,
    /// `module.block` → interface.
    pub interfaces: IndexMap<String, Interface>,
    pub verbs: IndexMap<String, Verb>,
    pub device_types: IndexMap<String, DeviceType>,
    pub svvs: IndexMap<String, Svv>,
    pub logical_devices: IndexMap<String, LogicalDevice>,
    /// Writers of SVVs among the existing instances, by SVV name.
    pub writers: IndexMap<String, Vec<Writer>>,
    /// `cell.place`: pattern (`move.planner`, `joint_servo.*`) → source.
    pub placement: IndexMap<String, String>,
}
