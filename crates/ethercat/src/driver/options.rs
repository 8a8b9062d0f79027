// SPDX-License-Identifier: Apache-2.0
//! The options of the driver: what they are, and what is refused.
use crate::main_device::Sync0;
use cia402::axis;
use device::{DriverError, Given, Kind, OptionWord};
use serde::Deserialize;
use serde_json::{Map, Value};

pub(super) const OPTIONS: [OptionWord; 7] = [
    OptionWord::needed("interface", Kind::Text, "the network interface that the segment hangs on, or `local:NAME` of an emulated one"),
    OptionWord::needed(
        "axes",
        Kind::List,
        "a table each: name, counts (to a unit of position); and at, mode, unit, speed_max, range, rated_torque, offset, pdos, brake, operating_within_s, vendor, product, revision, serial, alias",
    ),
    OptionWord::with_default("timeout_ns", Kind::Whole, "100 ms", "the watchdog of the drives: without commands for so long they stop by themselves")
        .unit("ns"),
    OptionWord::with_default("lost_after", Kind::Whole, "3", "so many cycles without an answer one after another mean that the device is lost"),
    OptionWord::with_default("lockstep", Kind::Bool, "false; true under the virtual clock", "a firing waits for its frame, and the drives have no watchdog"),
    OptionWord::with_default("sync0_ns", Kind::Whole, "none", "distributed clocks: how often SYNC0 of each axis comes, which is the period of the source")
        .unit("ns"),
    OptionWord::with_default("sync0_shift_ns", Kind::Whole, "half of sync0_ns", "how long after the release of the source SYNC0 comes").unit("ns"),
];

/// What is asked for.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Options {
    pub interface: String,
    pub axes: Vec<AxisOptions>,
    pub timeout_ns: Option<i64>,
    pub lost_after: Option<u32>,
    #[serde(default)]
    pub lockstep: bool,
    pub sync0_ns: Option<u32>,
    pub sync0_shift_ns: Option<u32>,
}

impl Options {
    /// SYNC0, where it is wanted.
    pub fn sync0(&self) -> Option<Sync0> {
        self.sync0_ns.map(|cycle_ns| Sync0 { cycle_ns, shift_ns: self.sync0_shift_ns.unwrap_or(cycle_ns / 2) })
    }
}

/// An axis, as it is asked for.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct AxisOptions {
    #[serde(flatten)]
    pub axis: axis::AxisOptions,
    /// Its place on the line; left out: that in the list.
    pub at: Option<usize>,
    /// Configured station alias of its drive, where it is to be compared.
    pub alias: Option<u16>,
    #[serde(default)]
    pub pdos: PdosFrom,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(super) enum PdosFrom {
    /// The driver writes which objects are exchanged.
    #[default]
    Written,
    /// Those that the drive exchanges already.
    Device,
}

/// Watchdog of the drives where nothing is said.
pub(super) const TIMEOUT_NS: i64 = 100_000_000;
/// Shorter than any drive's cycle.
const SYNC0_NS_MIN: u32 = 50_000;
/// The longest that a drive can be told.
const TIMEOUT_NS_MAX: i64 = 6_500_000_000;

/// Refuses what cannot be, by name.
pub(super) fn check(given: &Given<'_>, options: &Options) -> Result<(), DriverError> {
    let wrong = |problem: String| Err(given.wrong("axes", problem));
    device::check_timeout(given, options.timeout_ns)?;
    if options.timeout_ns.is_some_and(|ns| ns > TIMEOUT_NS_MAX) {
        return Err(given.wrong("timeout_ns", "at most 6.5 s: a drive cannot be told more"));
    }
    match (options.sync0_ns, options.sync0_shift_ns) {
        (None, Some(_)) => return Err(given.wrong("sync0_shift_ns", "sync0_ns is missing: the period of the source")),
        (Some(..SYNC0_NS_MIN), _) => return Err(given.wrong("sync0_ns", "at least 50 us: the period of the source")),
        (Some(cycle_ns), Some(shift_ns)) if shift_ns >= cycle_ns => return Err(given.wrong("sync0_shift_ns", "less than sync0_ns")),
        _ => {}
    }
    if options.axes.is_empty() {
        return wrong("name at least one axis".to_owned());
    }
    axis::check(options.axes.iter().map(|of| &of.axis)).or_else(wrong)?;
    for (index, of) in options.axes.iter().enumerate() {
        let place = |index: usize, of: &AxisOptions| of.at.unwrap_or(index);
        let name = &of.axis.name;
        axis::unknown(name, &of.rest, &["at", "pdos", "alias"]).or_else(wrong)?;
        for (other, before) in options.axes[..index].iter().enumerate() {
            if place(other, before) == place(index, of) {
                return wrong(format!("'{}' and '{name}' are both at place {}", before.axis.name, place(index, of)));
            }
        }
    }
    Ok(())
}
