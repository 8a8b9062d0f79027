// SPDX-License-Identifier: Apache-2.0
//! The options of the driver, and their refusals.
use crate::main_device::Sync0;
use crate::sii::PdoEntry;
use cia402::axis;
use cia402::identity::ExpectedIdentity;
use device::counts::{CountsOptions, given_twice};
use device::{DriverError, GivenOptions, Kind, Number, OptionWord};
use serde::Deserialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

pub(super) const OPTIONS: [OptionWord; 8] = [
    OptionWord::needed("interface", Kind::Text, "the network interface of the segment, or `local:NAME` of an emulated one"),
    OptionWord::with_default(
        "axes",
        Kind::List,
        "none",
        "a table each: name, counts (per unit of position); and at, mode, unit, speed_max, range, rated_torque, offset, pdos, brake, operating_within_s, vendor, product, revision, serial, alias",
    )
    .entries(&[&axis::FIELDS, &PLACE]),
    OptionWord::with_default(
        "terminals",
        Kind::List,
        "none",
        "terminals of inputs and outputs, a table each: name, at; and channels (a table each: entry, scale, offset, unit, safe), pdos, vendor, product, revision, serial, alias",
    )
    .entries(&[&axis::IDENTITY, &PLACE, &TERMINAL]),
    OptionWord::with_default("timeout_ns", Kind::Whole, "100 ms", "the watchdog of the drives: after this time without commands they stop by themselves")
        .unit("ns")
        .within(1e6, TIMEOUT_NS_MAX),
    OptionWord::with_default("lost_after", Kind::Whole, "3", "number of consecutive cycles without an answer after which the device is lost").within(1.0, u32::MAX as f64),
    OptionWord::with_default("lockstep", Kind::Bool, "false; true under the virtual clock", "whether a firing waits for its frame; the drives then have no watchdog"),
    OptionWord::with_default("sync0_ns", Kind::Whole, "none", "distributed clocks: interval between SYNC0 signals of each axis, which is the period of the source")
        .unit("ns")
        .within(SYNC0_NS_MIN, SYNC0_NS_MAX),
    OptionWord::with_default("sync0_shift_ns", Kind::Whole, "half of sync0_ns", "delay of SYNC0 after the release of the source")
        .unit("ns")
        .within(0.0, SYNC0_NS_MAX),
];

const PLACE: [OptionWord; 2] = [
    OptionWord::with_default("at", Kind::Whole, "that in the list", "its place on the line").within(0.0, 65535.0),
    OptionWord::with_default("alias", Kind::Whole, "not compared", "configured station alias").within(0.0, 65535.0),
];
const TERMINAL: [OptionWord; 2] = [
    OptionWord::with_default("channels", Kind::Table, "all entries", "by name").entries(&[&device::counts::WORDS]),
    OptionWord::with_default("pdos", Kind::List, "as in its EEPROM", "its process data").entries(&[&PDO]),
];
const PDO: [OptionWord; 1] = [OptionWord::needed("entries", Kind::List, "in their order").entries(&[&ENTRY])];
const ENTRY: [OptionWord; 4] = [
    OptionWord::with_default("index", Kind::Whole, "0: a gap", "its object").within(0.0, 65535.0),
    OptionWord::with_default("sub", Kind::Whole, "0", "its subindex").within(0.0, 255.0),
    OptionWord::needed("bits", Kind::Whole, "its length").within(0.0, 255.0),
    OptionWord::with_default("kind", Kind::Whole, "0: a number without a sign", "its data type, as numbered by CoE").within(0.0, 255.0),
];

/// Options of the driver.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Options {
    pub interface: String,
    #[serde(default)]
    pub axes: Vec<AxisOptions>,
    #[serde(default)]
    pub terminals: Vec<TerminalOptions>,
    pub timeout_ns: Option<i64>,
    pub lost_after: Option<u32>,
    #[serde(default)]
    pub lockstep: bool,
    pub sync0_ns: Option<u32>,
    pub sync0_shift_ns: Option<u32>,
}

impl Options {
    /// Returns the SYNC0 settings, if SYNC0 is requested.
    pub fn sync0(&self) -> Option<Sync0> {
        self.sync0_ns.map(|cycle_ns| Sync0 { cycle_ns, shift_ns: self.sync0_shift_ns.unwrap_or(cycle_ns / 2) })
    }
}

/// Options of an axis.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct AxisOptions {
    #[serde(flatten)]
    pub axis: axis::AxisOptions,
    /// Position on the line; if omitted, the position in the list.
    pub at: Option<usize>,
    /// Configured station alias of the drive, if it is to be checked.
    pub alias: Option<u16>,
    #[serde(default)]
    pub pdos: PdosFrom,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(super) enum PdosFrom {
    /// The driver writes the mapping.
    #[default]
    Written,
    /// The drive keeps its current PDOs.
    Device,
}

/// Options of an input and output terminal.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TerminalOptions {
    pub name: String,
    /// Position on the line.
    pub at: usize,
    /// Channels by name; if omitted, all entries of the terminal.
    pub channels: Option<BTreeMap<String, ChannelOptions>>,
    /// Process data as described in the vendor's file; if omitted, as described in the EEPROM.
    pub pdos: Option<Vec<PdoOptions>>,
    vendor: Option<u32>,
    product: Option<u32>,
    revision: Option<u32>,
    serial: Option<u32>,
    alias: Option<u16>,
}

impl TerminalOptions {
    /// Returns the expected identity.
    pub fn expected(&self) -> ExpectedIdentity {
        ExpectedIdentity { vendor: self.vendor, product: self.product, revision: self.revision, serial: self.serial, alias: self.alias }
    }
}

/// A PDO that a terminal exchanges.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PdoOptions {
    pub output: bool,
    #[serde(default)]
    pub name: String,
    pub entries: Vec<EntryOptions>,
}

/// An entry of a PDO; index 0 for a gap.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EntryOptions {
    #[serde(default)]
    pub index: u16,
    #[serde(default)]
    pub sub: u8,
    pub bits: u8,
    /// CoE data type number; 0 for an unsigned number.
    #[serde(default)]
    pub kind: u8,
    #[serde(default)]
    pub name: String,
}

impl From<&PdoEntry> for EntryOptions {
    fn from(of: &PdoEntry) -> EntryOptions {
        EntryOptions { index: of.of.index, sub: of.of.sub, bits: of.bits, kind: of.kind, name: of.name.clone() }
    }
}

/// Options of a terminal's channel: its entry and the scaling of its counts.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct ChannelOptions {
    /// Entry of the channel; if omitted, the entry with the channel's name.
    pub entry: Option<String>,
    #[serde(flatten)]
    pub of: CountsOptions,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

impl ChannelOptions {
    /// Returns the reason why these options cannot describe a channel for an entry with this number type, if any.
    pub fn problem(&self, number: Number, is_output: bool) -> Option<String> {
        match self.rest.keys().next() {
            Some(field) => Some(format!("has no {field}; a channel has only entry, scale, offset, unit and safe")),
            None => self.of.problem(number == Number::Bool, is_output),
        }
    }
}

/// Default watchdog time of the drives.
pub(super) const TIMEOUT_NS: i64 = 100_000_000;
/// Minimum period of SYNC0; shorter than the cycle of any drive.
const SYNC0_NS_MIN: f64 = 5e4;
/// Maximum period of SYNC0; drives store it in 32 bits.
const SYNC0_NS_MAX: f64 = u32::MAX as f64;
/// Maximum watchdog time that can be set in a drive.
const TIMEOUT_NS_MAX: f64 = 6.5e9;

/// Refuses invalid options; the refusal lists all of them.
pub(super) fn check(given: &GivenOptions<'_>, options: &Options) -> Result<(), DriverError> {
    let wrong = |problem: String| Err(given.wrong("axes", problem));
    match (options.sync0_ns, options.sync0_shift_ns) {
        (None, Some(_)) => return Err(given.wrong("sync0_shift_ns", "sync0_ns is missing: the period of the source")),
        (Some(cycle_ns), Some(shift_ns)) if shift_ns >= cycle_ns => return Err(given.wrong("sync0_shift_ns", "less than sync0_ns")),
        _ => {}
    }
    if options.axes.is_empty() && options.terminals.is_empty() {
        return wrong("name at least one axis or terminal".to_owned());
    }
    axis::check(options.axes.iter().map(|of| &of.axis)).or_else(wrong)?;
    for of in &options.axes {
        axis::unknown(&of.axis.name, &of.rest, &["at", "pdos", "alias"]).or_else(wrong)?;
    }
    check_places(options).or_else(wrong)
}

/// Refuses duplicate names and positions.
fn check_places(options: &Options) -> Result<(), String> {
    let axes = options.axes.iter().enumerate().map(|(index, of)| (of.axis.name.as_str(), of.at.unwrap_or(index)));
    let all: Vec<(&str, usize)> = axes.chain(options.terminals.iter().map(|of| (of.name.as_str(), of.at))).collect();
    given_twice(&all, |place| format!("at place {place}")).map_or(Ok(()), Err)
}
