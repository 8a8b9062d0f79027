// SPDX-License-Identifier: Apache-2.0
//! Options of an axis, and their refusals.
use crate::brake::{self, BrakeOptions};
use crate::commander::Scale;
use crate::identity::ExpectedIdentity;
use crate::states::Mode;
use device::{Kind, OptionWord};
use serde::Deserialize;
use serde_json::{Map, Value};

/// Options of an axis, without those that its bus adds.
#[derive(Clone, Debug, Deserialize)]
pub struct AxisOptions {
    pub name: String,
    #[serde(default)]
    pub mode: CommandKind,
    /// Counts per unit of position.
    pub counts: f64,
    #[serde(default)]
    pub unit: Unit,
    /// Maximum speed, units of position per second.
    pub speed_max: Option<f64>,
    pub range: Option<[f64; 2]>,
    /// N.m or N.
    pub rated_torque: Option<f64>,
    /// Counts at position 0.
    #[serde(default)]
    pub offset: f64,
    /// Output for the brake; omitted if the drive controls the brake itself, or if there is no brake.
    pub brake: Option<BrakeOptions>,
    /// Identity of the drive (object 0x1018), if it is to be checked.
    pub vendor: Option<u32>,
    pub product: Option<u32>,
    pub revision: Option<u32>,
    pub serial: Option<u32>,
    /// Time limit for the drive to reach the Operation Enabled state after it was engaged, s.
    #[serde(default = "operating_within_s")]
    pub operating_within_s: f64,
}

fn operating_within_s() -> f64 {
    3.0
}

/// Largest 32-bit number.
const U32: f64 = u32::MAX as f64;

/// Options that an axis has on every bus.
pub const FIELDS: [OptionWord; 14] = [
    OptionWord::needed("name", Kind::Text, "its name"),
    OptionWord::needed("counts", Kind::Number, "counts per unit of position, negative to reverse the axis").within(-1e12, 1e12),
    OptionWord::with_default("mode", Kind::Text, "position", "its command: position, velocity or torque"),
    OptionWord::with_default("unit", Kind::Text, "rad", "unit of its position: rad or m"),
    OptionWord::with_default("speed_max", Kind::Number, "no limit", "units of position per second").above(0.0, 1e6),
    OptionWord::with_default("range", Kind::List, "no limit", "minimum and maximum position").within(-1e9, 1e9),
    OptionWord::with_default("rated_torque", Kind::Number, "none", "N.m or N").above(0.0, 1e5),
    OptionWord::with_default("offset", Kind::Number, "0", "counts at position 0").within(-1e12, 1e12),
    OptionWord::with_default("brake", Kind::Table, "none", "the output of its brake").fields(&[&brake::FIELDS]),
    OptionWord::with_default("operating_within_s", Kind::Number, "3", "time limit for its drive to come into operation").unit("s").above(0.0, 3600.0),
    OptionWord::with_default("vendor", Kind::Whole, "not compared", "vendor of its drive").within(0.0, U32),
    OptionWord::with_default("product", Kind::Whole, "not compared", "product code of its drive").within(0.0, U32),
    OptionWord::with_default("revision", Kind::Whole, "not compared", "revision of its drive").within(0.0, U32),
    OptionWord::with_default("serial", Kind::Whole, "not compared", "serial number of its drive").within(0.0, U32),
];

/// Numeric options that identify a device (object 0x1018).
pub const IDENTITY: [OptionWord; 4] = [FIELDS[10], FIELDS[11], FIELDS[12], FIELDS[13]];

/// Kind of command of an axis.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum CommandKind {
    #[default]
    Position,
    Velocity,
    Torque,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    #[default]
    Rad,
    M,
}

impl CommandKind {
    pub fn mode(self) -> Mode {
        match self {
            CommandKind::Position => Mode::Position,
            CommandKind::Velocity => Mode::Velocity,
            CommandKind::Torque => Mode::Torque,
        }
    }
}

impl AxisOptions {
    /// Returns the expected identity of the drive.
    pub fn expected(&self) -> ExpectedIdentity {
        ExpectedIdentity { vendor: self.vendor, product: self.product, revision: self.revision, serial: self.serial, alias: None }
    }

    pub fn scale(&self) -> Scale {
        let speed_max = self.speed_max.unwrap_or(f64::INFINITY);
        Scale { mode: self.mode.mode(), counts: self.counts, offset: self.offset, speed_max, rated_torque: self.rated_torque.unwrap_or(1.0) }
    }
}

/// Refuses unknown options of an axis; `own` lists those that the bus adds.
///
/// # Errors
/// Fails with a message.
pub fn unknown(name: &str, rest: &Map<String, Value>, own: &[&str]) -> Result<(), String> {
    let Some(field) = rest.keys().next() else { return Ok(()) };
    Err(format!("'{name}': there is no {field}; an axis has {}, {}", FIELDS.map(|word| word.name).join(", "), own.join(", ")))
}

/// Refuses invalid options of axes.
///
/// # Errors
/// Fails with a message that contains the name of the axis.
pub fn check<'a>(axes: impl Iterator<Item = &'a AxisOptions> + Clone) -> Result<(), String> {
    for (index, axis) in axes.clone().enumerate() {
        let name = &axis.name;
        if axes.clone().take(index).any(|before| before.name == *name) {
            return Err(format!("'{name}' is named twice"));
        }
        if let Some(problem) = problem(axis) {
            return Err(format!("'{name}': {problem}"));
        }
    }
    Ok(())
}

fn problem(axis: &AxisOptions) -> Option<String> {
    let is_torque = axis.mode == CommandKind::Torque;
    let wrong = |is: bool, problem: &str| is.then(|| problem.to_owned());
    if !axis.counts.is_normal() {
        return Some(format!("counts cannot be {}; give the number of counts per unit of position, negative to reverse the axis", axis.counts));
    }
    wrong(axis.range.is_some_and(|[minimum, maximum]| minimum >= maximum), "range must be a minimum and a larger maximum position")
        .or_else(|| wrong(is_torque && axis.rated_torque.is_none(), "an axis that is commanded by torque needs its rated_torque"))
        .or_else(|| wrong(is_torque && axis.brake.is_some(), "a brake needs a motor that holds the axis while it closes: mode position or velocity"))
}
