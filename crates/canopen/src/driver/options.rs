// SPDX-License-Identifier: Apache-2.0
//! The options of the driver, checked.
use crate::nmt::NODE_MAX;
use cia402::{Mode, Scale};
use device::{DriverError, Given, UNLIMITED};
use serde::Deserialize;

/// Where nothing is said.
const TIMEOUT_NS: i64 = 100_000_000;
const CYCLE_NS: i64 = 10_000_000;
pub const HEARTBEAT_NS: i64 = 100_000_000;
const LOST_AFTER: u32 = 3;
const OWN_NODE: u8 = 127;
/// The longest time that a node can be told.
const TOLD_NS_MAX: i64 = 65_535_000_000;
/// The identifiers of a bus of 1 Mbit/s have no room for more.
const AXES_MAX: usize = 32;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    interface: String,
    axes: Vec<AxisOptions>,
    timeout_ns: Option<i64>,
    cycle_ns: Option<i64>,
    heartbeat_ns: Option<i64>,
    lost_after: Option<u32>,
    own_node: Option<u64>,
}

/// All of them, with what is left out.
pub struct Options {
    pub interface: String,
    pub axes: Vec<AxisOptions>,
    /// The watchdog of the drives.
    pub timeout_ns: i64,
    pub cycle_ns: i64,
    /// How often a drive says that it is there.
    pub heartbeat_ns: i64,
    pub lost_after: u32,
    pub own_node: u8,
}

/// An axis, as it is asked for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisOptions {
    pub name: String,
    /// Its number on the bus.
    pub node: u8,
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
    /// Whether the drive is to watch for this controller.
    pub watchdog: Option<bool>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Commanded {
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

impl AxisOptions {
    pub fn scale(&self) -> Scale {
        let mode = match self.mode {
            Commanded::Position => Mode::Position,
            Commanded::Velocity => Mode::Velocity,
            Commanded::Torque => Mode::Torque,
        };
        let speed_max = self.speed_max.unwrap_or(f64::INFINITY);
        Scale { mode, counts: self.counts, offset: self.offset, speed_max, rated_torque: self.rated_torque.unwrap_or(1.0) }
    }

    pub fn is_watched(&self) -> bool {
        self.watchdog != Some(false)
    }
}

/// Reads and checks them.
///
/// # Errors
/// [`DriverError::Option`] names one that is wrong.
pub fn read(given: &Given<'_>) -> Result<Options, DriverError> {
    let written: Written = given.read()?;
    device::check_timeout(given, written.timeout_ns)?;
    let time = |name: &str, of: Option<i64>, default: i64| match of.unwrap_or(default) {
        ns @ 1_000_000..=TOLD_NS_MAX => Ok(ns),
        ns => Err(given.wrong(name, format!("it is {} ms; 1 ms to 65.535 s can be told to a drive", ns as f64 * 1e-6))),
    };
    let own_node = written.own_node.unwrap_or(u64::from(OWN_NODE));
    let options = Options {
        timeout_ns: time("timeout_ns", written.timeout_ns, TIMEOUT_NS)?,
        heartbeat_ns: time("heartbeat_ns", written.heartbeat_ns, HEARTBEAT_NS)?,
        cycle_ns: written.cycle_ns.unwrap_or(CYCLE_NS),
        lost_after: written.lost_after.unwrap_or(LOST_AFTER).max(1),
        own_node: u8::try_from(own_node).ok().filter(|node| is_node(*node)).ok_or_else(|| given.wrong("own_node", "nodes are 1 to 127"))?,
        interface: written.interface,
        axes: written.axes,
    };
    if !(250_000..=1_000_000_000).contains(&options.cycle_ns) {
        return Err(given.wrong("cycle_ns", "0.25 ms to 1 s: the period of the source that exchanges it"));
    }
    check_axes(given, &options)?;
    Ok(options)
}

fn is_node(node: u8) -> bool {
    (1..=NODE_MAX).contains(&node)
}

fn check_axes(given: &Given<'_>, options: &Options) -> Result<(), DriverError> {
    let wrong = |problem: String| Err(given.wrong("axes", problem));
    if options.axes.is_empty() || options.axes.len() > AXES_MAX {
        return wrong(format!("{} are named; 1 to {AXES_MAX} axes are on a bus", options.axes.len()));
    }
    for (index, axis) in options.axes.iter().enumerate() {
        let name = &axis.name;
        for before in &options.axes[..index] {
            if before.name == *name {
                return wrong(format!("'{name}' is named twice"));
            }
            if before.node == axis.node {
                return wrong(format!("'{}' and '{name}' are both node {}", before.name, axis.node));
            }
        }
        if !is_node(axis.node) || axis.node == options.own_node {
            return wrong(format!("'{name}': node is {}; nodes are 1 to 127, and {} is this controller (own_node)", axis.node, options.own_node));
        }
        if !axis.counts.is_normal() {
            return wrong(format!("'{name}': counts is {}; give how many counts are one unit of position, negative to turn it round", axis.counts));
        }
        if axis.speed_max.is_some_and(|speed| !(speed > 0.0 && speed.is_finite())) {
            return wrong(format!("'{name}': speed_max is above 0"));
        }
        if !axis.offset.is_finite() {
            return wrong(format!("'{name}': offset is a number of counts"));
        }
        if axis.range.is_some_and(|[least, greatest]| least.is_nan() || greatest.is_nan() || least >= greatest) {
            return wrong(format!("'{name}': range is the least and the greatest position"));
        }
        if axis.rated_torque.is_some_and(|torque| !(torque > 0.0 && torque < UNLIMITED)) {
            return wrong(format!("'{name}': rated_torque is above 0"));
        }
        if axis.mode == Commanded::Torque && axis.rated_torque.is_none() {
            return wrong(format!("'{name}': an axis that is commanded by torque needs its rated_torque"));
        }
    }
    Ok(())
}
