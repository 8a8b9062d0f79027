// SPDX-License-Identifier: Apache-2.0
//! Validated options of the driver.
use crate::eds::Eds;
use crate::pdo::PDOS;
use cia402::axis;
use cia402::identity::ExpectedIdentity;
use device::counts::{CountsOptions, given_twice};
use device::{DriverError, GivenOptions};
use serde::Deserialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Default watchdog time of the nodes.
const TIMEOUT_NS: i64 = 100_000_000;
const CYCLE_NS: i64 = 10_000_000;
pub const HEARTBEAT_NS: i64 = 100_000_000;
const LOST_AFTER: u32 = 3;
const OWN_NODE: u8 = 127;
/// Maximum time that can be set in a node.
pub const TOLD_NS_MAX: i64 = 65_535_000_000;
/// Maximum number of nodes; a 1 Mbit/s bus does not have the bandwidth for the frames of more.
const NODES_MAX: usize = 32;
/// Maximum number of digital terminals in a PDO, and maximum number of analog terminals in all other PDOs together.
pub const DIGITAL_MAX: u8 = 64;
pub const ANALOG_MAX: u8 = 4 * (PDOS as u8 - 1);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenOptions {
    interface: String,
    #[serde(default)]
    axes: Vec<AxisOptions>,
    #[serde(default)]
    modules: Vec<ModuleOptions>,
    timeout_ns: Option<i64>,
    cycle_ns: Option<i64>,
    heartbeat_ns: Option<i64>,
    lost_after: Option<u32>,
    own_node: Option<u8>,
}

/// Options with defaults filled in.
pub struct Options {
    pub interface: String,
    pub axes: Vec<AxisOptions>,
    pub modules: Vec<ModuleOptions>,
    /// Watchdog time of the nodes.
    pub timeout_ns: i64,
    pub cycle_ns: i64,
    /// Period of a node's heartbeat.
    pub heartbeat_ns: i64,
    pub lost_after: u32,
    pub own_node: u8,
}

/// Options of an axis.
#[derive(Clone, Debug, Deserialize)]
pub struct AxisOptions {
    #[serde(flatten)]
    pub axis: axis::AxisOptions,
    /// Number of the node on the bus.
    pub node: u8,
    /// True if the drive must monitor this controller.
    pub watchdog: Option<bool>,
    #[serde(default)]
    pub pdos: PdosFrom,
    /// Electronic data sheet of the node.
    pub eds: Option<PathBuf>,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

/// Origin of the PDO mapping of a node.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum PdosFrom {
    /// The driver writes the mapping.
    #[default]
    Written,
    /// The node keeps its current mapping.
    Device,
}

/// Options of an input and output module.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModuleOptions {
    pub name: String,
    pub node: u8,
    /// Channels by name.
    pub channels: BTreeMap<String, ChannelOptions>,
    pub watchdog: Option<bool>,
    pub eds: Option<PathBuf>,
    /// Required identity of the module (object 0x1018), if it is to be checked.
    vendor: Option<u32>,
    product: Option<u32>,
    revision: Option<u32>,
    serial: Option<u32>,
}

impl ModuleOptions {
    /// Returns the expected identity.
    pub fn expected(&self) -> ExpectedIdentity {
        ExpectedIdentity { vendor: self.vendor, product: self.product, revision: self.revision, serial: self.serial, alias: None }
    }
}

/// Options of a module's channel: its terminal and the scaling of its counts.
#[derive(Clone, Debug, Deserialize)]
pub struct ChannelOptions {
    input: Option<u8>,
    output: Option<u8>,
    analog_input: Option<u8>,
    analog_output: Option<u8>,
    #[serde(flatten)]
    pub of: CountsOptions,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

/// A terminal of a module, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terminal {
    Input(u8),
    Output(u8),
    AnalogInput(u8),
    AnalogOutput(u8),
}

impl fmt::Display for Terminal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Terminal::Input(number) => write!(f, "digital input {number}"),
            Terminal::Output(number) => write!(f, "digital output {number}"),
            Terminal::AnalogInput(number) => write!(f, "analog input {number}"),
            Terminal::AnalogOutput(number) => write!(f, "analog output {number}"),
        }
    }
}

impl Terminal {
    pub fn is_input(self) -> bool {
        matches!(self, Terminal::Input(_) | Terminal::AnalogInput(_))
    }

    fn is_digital(self) -> bool {
        matches!(self, Terminal::Input(_) | Terminal::Output(_))
    }
}

impl ChannelOptions {
    fn terminals(&self) -> impl Iterator<Item = Terminal> {
        let digital = [self.input.map(Terminal::Input), self.output.map(Terminal::Output)];
        let analog = [self.analog_input.map(Terminal::AnalogInput), self.analog_output.map(Terminal::AnalogOutput)];
        digital.into_iter().chain(analog).flatten()
    }

    /// Returns the channel's terminal, whose existence has already been checked.
    pub fn terminal(&self) -> Terminal {
        self.terminals().next().unwrap_or(Terminal::Input(0))
    }

    fn problem(&self) -> Option<String> {
        let terminals: Vec<Terminal> = self.terminals().collect();
        let [terminal] = terminals[..] else { return Some("must be one of input, output, analog_input and analog_output".to_owned()) };
        match self.rest.keys().next() {
            Some(field) => Some(format!("has no {field}; besides its terminal a channel has only scale, offset, unit and safe")),
            None => self.of.problem(terminal.is_digital(), !terminal.is_input()),
        }
    }
}

/// Parses and checks the options.
///
/// # Errors
/// Fails with [`DriverError::Option`], which names the invalid option.
pub fn read(given: &GivenOptions<'_>) -> Result<Options, DriverError> {
    let written: WrittenOptions = given.read()?;
    let options = Options {
        timeout_ns: written.timeout_ns.unwrap_or(TIMEOUT_NS),
        heartbeat_ns: written.heartbeat_ns.unwrap_or(HEARTBEAT_NS),
        cycle_ns: written.cycle_ns.unwrap_or(CYCLE_NS),
        lost_after: written.lost_after.unwrap_or(LOST_AFTER),
        own_node: written.own_node.unwrap_or(OWN_NODE),
        interface: written.interface,
        axes: written.axes,
        modules: written.modules,
    };
    check_axes(&options).map_err(|problem| given.wrong("axes", problem))?;
    check_modules(&options).map_err(|problem| given.wrong("modules", problem))?;
    check_nodes(&options).map_err(|problem| given.wrong("axes", problem))?;
    Ok(options)
}

/// Reads the electronic data sheet of a node.
///
/// # Errors
/// Fails if the file cannot be read or is not a data sheet.
pub fn data_sheet(given: &GivenOptions<'_>, file: Option<&Path>) -> Result<Option<Arc<Eds>>, DriverError> {
    let Some(path) = file else { return Ok(None) };
    let failed = |problem: String| given.wrong("eds", format!("'{}': {problem}", path.display()));
    let bytes = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    Eds::read(&bytes).map(|eds| Some(Arc::new(eds))).map_err(failed)
}

fn check_axes(options: &Options) -> Result<(), String> {
    for of in &options.axes {
        axis::unknown(&of.axis.name, &of.rest, &["node", "watchdog", "pdos", "eds"])?;
    }
    axis::check(options.axes.iter().map(|of| &of.axis))
}

fn check_modules(options: &Options) -> Result<(), String> {
    for module in &options.modules {
        let name = &module.name;
        for (channel, of) in &module.channels {
            if channel == "error" {
                return Err(format!("'{name}': its channel 'error' is reserved for its emergencies; give this one another name"));
            }
            if let Some(problem) = of.problem() {
                return Err(format!("'{name}': channel '{channel}' {problem}"));
            }
        }
        let terminals: Vec<(&str, Terminal)> = module.channels.iter().map(|(channel, of)| (channel.as_str(), of.terminal())).collect();
        if let Some(twice) = given_twice(&terminals, Terminal::to_string) {
            return Err(format!("'{name}': {twice}"));
        }
    }
    Ok(())
}

fn check_nodes(options: &Options) -> Result<(), String> {
    let axes = options.axes.iter().map(|of| (of.axis.name.as_str(), of.node));
    let nodes: Vec<(&str, u8)> = axes.chain(options.modules.iter().map(|of| (of.name.as_str(), of.node))).collect();
    if nodes.is_empty() || nodes.len() > NODES_MAX {
        return Err(format!("{} are named; a bus must have 1 to {NODES_MAX} axes and modules", nodes.len()));
    }
    if let Some((name, node)) = nodes.iter().find(|(_, node)| *node == options.own_node) {
        return Err(format!("'{name}': node {node} is the number of this controller (own_node); give one of them another number"));
    }
    given_twice(&nodes, |node| format!("node {node}")).map_or(Ok(()), Err)
}
