// SPDX-License-Identifier: Apache-2.0
//! State of a system when a verb is applied: hardware, code, SVVs, devices, and what is already installed.
//! The supervisor keeps it; the checks only read it.
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
    /// `part.channel` or a plain name.
    pub name: String,
    /// False: it is read; true: it is written.
    pub write: bool,
    pub type_text: String,
    pub unit: String,
}

/// A physical device, served by one source of its RTP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhysicalDevice {
    pub processor: String,
    /// `rtp.name` of the source that reads and writes it.
    pub source: String,
    pub channels: Vec<Channel>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// An SVV that exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Svv {
    pub id: SvvId,
    /// C type as given, and the struct types it needs are in `types`.
    pub type_text: String,
    pub unit: String,
    #[serde(default)]
    pub types: IndexMap<String, String>,
    /// Number of its values that are kept.
    #[serde(default)]
    pub history: u32,
    /// The logical device it belongs to.
    #[serde(default)]
    pub device: Option<String>,
    /// True if it was made with the first of the devices that share it; it goes with the last.
    #[serde(default)]
    pub shared: bool,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// A logical device that exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogicalDevice {
    pub device_type: String,
    /// Member → SVV name (`arm.elbow.sensed`).
    pub svvs: IndexMap<String, String>,
    pub parameters: IndexMap<String, Value>,
    /// Further arguments of its own verb (`drive`).
    pub arguments: IndexMap<String, crate::definition::Argument>,
    /// Where its own verb runs, `rtp.name`.
    #[serde(default)]
    pub source: Option<String>,
    pub enabled: bool,
    /// Parts of units that are others for this device than its type says, in order: (`rad`, `m`) of a sliding joint.
    #[serde(default)]
    pub units: Vec<(String, String)>,
    /// Arbitration of a second verb that commands it, if it is not as its type says.
    #[serde(default)]
    pub arbitration: Option<Arbitration>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

impl LogicalDevice {
    /// Returns a unit that the type declares, as it is for this device.
    pub fn unit(&self, declared: &str) -> String {
        self.units.iter().fold(declared.to_owned(), |unit, (from, to)| unit.replace(from.as_str(), to))
    }
}

/// Rate at which a writer updates, in one command list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Rate {
    /// Every `period_ns` of the timers of one host (all timers of a host share its epoch).
    Interval { period_ns: u64 },
    /// It updates at each occurrence of this source (or each n-th).
    Trigger { source: String, every: u32 },
    /// It updates by `execute` only.
    Once,
}

/// Present writer of an SVV: a port of an installed instance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Writer {
    /// Verb instance, for example `joint_servo#2`.
    pub instance: String,
    /// Flat label and port: `read.y`.
    pub port: String,
    /// `rtp.name`.
    pub source: String,
    pub mode: Mode,
    /// The rates it has in the command lists of its verb.
    pub rates: Vec<Rate>,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// Everything that a check may ask for.
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
    /// Writers of SVVs among the instances that exist (not deleted), by SVV name.
    pub writers: IndexMap<String, Vec<Writer>>,
    /// `cell.place`: pattern (`move.planner`, `joint_servo.*`) → source.
    pub placement: IndexMap<String, String>,
}
