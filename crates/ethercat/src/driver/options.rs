// SPDX-License-Identifier: Apache-2.0
//! The declaration of the driver, and its options.
use super::axis::Axis;
use super::device::EtherCat;
use super::services::SERVICES;
use crate::cia402::Mode;
use crate::main_device::{Bus, inventory};
use device::{
    Class, Command, CounterWord, Declaration, DriverError, Found, Given, Kind, Layout, Life, Opened, OptionWord, Part, SafeBy, SafeState, Servo, UNLIMITED,
};
use serde::Deserialize;
use serde_json::json;

/// The driver.
pub static DRIVER: Declaration = Declaration {
    class: Class::Inline,
    life: Life { waits_ns: 0, lost_within_ns: 0 },
    safe_state: SafeState { doc: "quick stop: each axis comes to rest and is switched off", by: &[SafeBy::Driver, SafeBy::Device], within_ns: 0 },
    services: &SERVICES,
    counters: &COUNTERS,
    rights: &["raw frames on a network interface: cap_net_raw"],
    scan: Some(scan),
    ..Declaration::new("ethercat", "drives by CiA 402 on EtherCAT, an axis each", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 4] = [
    OptionWord::needed("interface", Kind::Text, "the network interface that the segment hangs on, or `local:NAME` of an emulated one"),
    OptionWord::needed(
        "axes",
        Kind::List,
        "a table each: name, counts (to a unit of position); and at, mode, unit, speed_max, range, rated_torque, offset, pdos",
    ),
    OptionWord::with_default("timeout_ns", Kind::Whole, "100 ms", "the watchdog of the drives: without commands for so long they stop by themselves")
        .unit("ns"),
    OptionWord::with_default("lost_after", Kind::Whole, "3", "so many cycles without an answer one after another mean that the device is lost"),
];

/// Indices into the counters.
pub(super) mod count {
    pub const CYCLES: usize = 0;
    pub const LOST: usize = 1;
    pub const SHORT: usize = 2;
    pub const REFUSED: usize = 3;
}

pub(super) const COUNTERS: [CounterWord; 4] = [
    CounterWord { name: "cycles", unit: "", doc: "frames that were sent" },
    CounterWord { name: "frames_lost", unit: "", doc: "frames that did not come back in time" },
    CounterWord { name: "working_counter_errors", unit: "", doc: "frames that came back and that not all subdevices took" },
    CounterWord { name: "frames_refused", unit: "", doc: "frames that came and were no answer: malformed, changed, or late" },
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    interface: String,
    axes: Vec<AxisOptions>,
    timeout_ns: Option<i64>,
    lost_after: Option<u32>,
}

/// An axis, as it is asked for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisOptions {
    pub name: String,
    /// Its place on the line; left out: that in the list.
    pub at: Option<usize>,
    #[serde(default)]
    pub mode: Commanded,
    /// Counts to a unit of position.
    pub counts: f64,
    #[serde(default)]
    pub unit: Unit,
    /// Units of position per second.
    pub speed_max: Option<f64>,
    pub range: Option<[f64; 2]>,
    /// N.m or N.
    pub rated_torque: Option<f64>,
    /// Counts at position 0.
    #[serde(default)]
    pub offset: f64,
    #[serde(default)]
    pub pdos: PdosFrom,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(super) enum Commanded {
    #[default]
    Position,
    Velocity,
    Torque,
}

impl Commanded {
    pub fn mode(self) -> Mode {
        match self {
            Commanded::Position => Mode::Position,
            Commanded::Velocity => Mode::Velocity,
            Commanded::Torque => Mode::Torque,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(super) enum Unit {
    #[default]
    Rad,
    M,
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
const TIMEOUT_NS: i64 = 100_000_000;
/// The longest that a drive can be told.
const TIMEOUT_NS_MAX: i64 = 6_500_000_000;

fn open(given: &Given<'_>) -> Result<Opened, DriverError> {
    let options: Options = given.read()?;
    check(given, &options)?;
    let timeout_ns = options.timeout_ns.unwrap_or(TIMEOUT_NS);
    let mut layout = Layout::default();
    let axes: Vec<Axis> = options.axes.iter().enumerate().map(|(index, axis)| Axis::new(axis, index, &mut layout)).collect();
    let parts: Vec<Part> = options.axes.iter().filter_map(part).collect();
    let driver = EtherCat::new(options.interface, axes, layout.into_channels(), timeout_ns, options.lost_after.unwrap_or(3).max(1));
    Ok((Box::new(driver), json!({ "parts": parts })))
}

fn check(given: &Given<'_>, options: &Options) -> Result<(), DriverError> {
    let wrong = |problem: String| Err(given.wrong("axes", problem));
    device::check_timeout(given, options.timeout_ns)?;
    if options.timeout_ns.is_some_and(|ns| ns > TIMEOUT_NS_MAX) {
        return Err(given.wrong("timeout_ns", "at most 6.5 s: a drive cannot be told more"));
    }
    if options.axes.is_empty() {
        return wrong("name at least one axis".to_owned());
    }
    for (index, axis) in options.axes.iter().enumerate() {
        let place = |index: usize, axis: &AxisOptions| axis.at.unwrap_or(index);
        let name = &axis.name;
        for (other, before) in options.axes[..index].iter().enumerate() {
            if before.name == *name {
                return wrong(format!("'{name}' is named twice"));
            }
            if place(other, before) == place(index, axis) {
                return wrong(format!("'{}' and '{name}' are both at place {}", before.name, place(index, axis)));
            }
        }
        if !axis.counts.is_normal() {
            return wrong(format!("'{name}': counts is {}; give how many counts are one unit of position, negative to turn it round", axis.counts));
        }
        if axis.speed_max.is_some_and(|speed| !(speed > 0.0 && speed.is_finite())) {
            return wrong(format!("'{name}': speed_max is above 0"));
        }
        if axis.range.is_some_and(|[least, greatest]| least.is_nan() || greatest.is_nan() || least >= greatest) {
            return wrong(format!("'{name}': range is the least and the greatest position"));
        }
        if axis.mode == Commanded::Torque && !axis.rated_torque.is_some_and(|torque| torque > 0.0) {
            return wrong(format!("'{name}': an axis that is commanded by torque needs its rated_torque"));
        }
    }
    Ok(())
}

/// What can be made a joint of; an axis that is commanded by velocity is its channels alone.
fn part(axis: &AxisOptions) -> Option<Part> {
    let command = match axis.mode {
        Commanded::Position => Command::Position,
        Commanded::Torque => Command::Effort,
        Commanded::Velocity => return None,
    };
    let [range_min, range_max] = axis.range.unwrap_or([-UNLIMITED, UNLIMITED]);
    Some(Part {
        name: axis.name.clone(),
        unit: if axis.unit == Unit::M { "m" } else { "rad" },
        range_min,
        range_max,
        effort_max: axis.rated_torque.unwrap_or(UNLIMITED),
        speed_max: axis.speed_max.unwrap_or(UNLIMITED),
        home: 0.0,
        servo: Servo::default(),
        command,
    })
}

#[derive(Deserialize)]
struct Where {
    interface: Option<String>,
}

fn scan(given: &Given<'_>) -> Result<Vec<Found>, DriverError> {
    let Where { interface: Some(interface) } = given.read()? else {
        return Err(given.wrong("interface", "it is missing; give the network interface to look at: `ip link` lists them"));
    };
    let identities = Bus::open(&interface).and_then(|mut bus| inventory(&mut bus)).map_err(DriverError::Failed)?;
    let found = identities.iter().enumerate().map(|(position, identity)| {
        let (vendor, product, revision) = (identity.vendor, identity.product, identity.revision);
        let what =
            format!("{position}: '{}', vendor {vendor:#010x}, product {product:#010x}, revision {revision:#010x}, serial {}", identity.name, identity.serial);
        Found { what, options: json!({ "interface": interface, "axes": [{ "name": format!("axis{position}"), "at": position, "counts": 1 }] }) }
    });
    Ok(found.collect())
}
