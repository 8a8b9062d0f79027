// SPDX-License-Identifier: Apache-2.0
//! Declaration of the driver.
use super::axis::Axis;
use super::counters::Count;
use super::device::{CanOpen, OBJECT};
use super::module::Module;
use super::options::{self, ANALOG_MAX, DIGITAL_MAX, HEARTBEAT_NS, ModuleOptions, Options, TOLD_NS_MAX, Terminal, data_sheet};
use super::services::SERVICES;
use super::station::{Station, What};
use crate::client::Client;
use crate::emulator::{NodeOptions, Terminals};
use crate::interface::Interface;
use crate::nmt::NODE_MAX;
use cia402::Entry;
use cia402::axis::{self, part};
use device::{Class, Declaration, DriverError, FoundDevice, GivenOptions, Kind, Layout, Life, OpenedDriver, OptionWord, Part, Reach, SafeBy, SafeState};
use serde::Deserialize;
use serde_json::json;
use std::time::Duration;

/// Declaration of the driver `canopen`.
pub static DRIVER: Declaration = Declaration {
    class: Class::Inline,
    life: Life { waits_ns: 0, lost_within_ns: 4 * HEARTBEAT_NS },
    safe_state: SafeState {
        doc: "quick stop: each axis comes to rest along its own ramp and is switched off; each output of a module has its safe value",
        by: &[SafeBy::Driver, SafeBy::Guard, SafeBy::Device],
        within_ns: 0,
    },
    services: &SERVICES,
    counters: Count::WORDS,
    scan: Some(scan),
    ..Declaration::new("canopen", "CiA 402 drives on CANopen, one axis each, and CiA 401 modules", &OPTIONS, open)
};

/// Files that the driver reads: the electronic data sheets of axes and modules.
const SHEETS: Reach = Reach::Entries(&[("eds", Reach::File)]);

const OPTIONS: [OptionWord; 8] = [
    OptionWord::needed("interface", Kind::Text, "the interface of SocketCAN, `can0`; or `local:NAME` of an emulated bus, `emulated` for a new one"),
    OptionWord::with_default(
        "axes",
        Kind::List,
        "none",
        "a table each: name, node, counts (per unit of position); and mode, unit, speed_max, range, rated_torque, offset, brake, operating_within_s, watchdog, pdos, eds, vendor, product, revision, serial",
    )
    .entries(&[&axis::FIELDS, &NODE])
    .reaches(SHEETS),
    OptionWord::with_default(
        "modules",
        Kind::List,
        "none",
        "a table each: name, node, channels; a channel by its name: input, output, analog_input or analog_output, and scale, offset, unit, safe; and watchdog, eds, vendor, product, revision, serial",
    )
    .entries(&[&axis::IDENTITY, &NODE, &MODULE])
    .reaches(SHEETS),
    OptionWord::with_default("cycle_ns", Kind::Whole, "10 ms", "the period of the source that exchanges it, as sent to the drives")
        .unit("ns")
        .within(2.5e5, 1e9),
    OptionWord::with_default("timeout_ns", Kind::Whole, "100 ms", "the watchdog of the drives: after this time without a heartbeat they stop by themselves")
        .unit("ns")
        .within(1e6, TOLD_NS_MAX as f64),
    OptionWord::with_default("heartbeat_ns", Kind::Whole, "100 ms", "interval between heartbeats of the drives; the third one missed loses the device")
        .unit("ns")
        .within(1e6, TOLD_NS_MAX as f64),
    OptionWord::with_default("lost_after", Kind::Whole, "3", "number of consecutive cycles without process data after which the device is lost").within(1.0, u32::MAX as f64),
    OptionWord::with_default("own_node", Kind::Whole, "127", "the number of this controller on the bus").within(1.0, NODE_MAX as f64),
];

/// Option for the node number, used by axes and modules.
const NODE: [OptionWord; 1] = [OptionWord::needed("node", Kind::Whole, "its number on the bus").within(1.0, NODE_MAX as f64)];
const MODULE: [OptionWord; 1] = [OptionWord::needed("channels", Kind::Table, "by name").entries(&[&CHANNEL, &device::counts::WORDS])];
const ELSE: &str = "another terminal is given";
const CHANNEL: [OptionWord; 4] = [
    OptionWord::with_default("input", Kind::Whole, ELSE, "number of the digital input").within(0.0, DIGITAL_MAX as f64 - 1.0),
    OptionWord::with_default("output", Kind::Whole, ELSE, "number of the digital output").within(0.0, DIGITAL_MAX as f64 - 1.0),
    OptionWord::with_default("analog_input", Kind::Whole, ELSE, "number of the analog input").within(0.0, ANALOG_MAX as f64 - 1.0),
    OptionWord::with_default("analog_output", Kind::Whole, ELSE, "number of the analog output").within(0.0, ANALOG_MAX as f64 - 1.0),
];

fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = options::read(given)?;
    let mut layout = Layout::default();
    let mut stations = Vec::new();
    for of in &options.axes {
        let axis = Station::new(of.node, &of.axis.name, What::Axis(Box::new(Axis::new(of, &mut layout))));
        let eds = data_sheet(given, of.eds.as_deref())?;
        stations.push(Station { is_watched: of.watchdog != Some(false), mapping: of.pdos, eds, expected: of.axis.expected(), ..axis });
    }
    for of in &options.modules {
        let module = Station::new(of.node, &of.name, What::Module(Module::new(of, &mut layout)));
        stations.push(Station { is_watched: of.watchdog != Some(false), eds: data_sheet(given, of.eds.as_deref())?, expected: of.expected(), ..module });
    }
    let parts: Vec<Part> = options.axes.iter().filter_map(|of| part(&of.axis)).collect();
    let bus = Interface::of(&options.interface, || emulated(&options));
    Ok((Box::new(CanOpen::new(&options, bus, stations, layout.into_channels())), json!({ "parts": parts })))
}

/// Returns the nodes of an emulated bus that satisfies the options.
fn emulated(options: &Options) -> Vec<NodeOptions> {
    let axes = options.axes.iter().map(|of| NodeOptions { name: of.axis.name.clone(), node: of.node, ..NodeOptions::default() });
    let modules = options.modules.iter().map(|of| NodeOptions { name: of.name.clone(), node: of.node, module: Some(terminals(of)), ..NodeOptions::default() });
    axes.chain(modules).collect()
}

/// Returns the number of terminals of each kind that the channels of a module need.
fn terminals(of: &ModuleOptions) -> Terminals {
    let mut all = Terminals::default();
    for channel in of.channels.values() {
        let (count, number) = match channel.terminal() {
            Terminal::Input(number) => (&mut all.inputs, number),
            Terminal::Output(number) => (&mut all.outputs, number),
            Terminal::AnalogInput(number) => (&mut all.analog_inputs, number),
            Terminal::AnalogOutput(number) => (&mut all.analog_outputs, number),
        };
        *count = (*count).max(number + 1);
    }
    all
}

#[derive(Deserialize)]
struct Where {
    interface: Option<String>,
}

/// Time limit for a node to identify itself.
const ANSWER: Duration = Duration::from_millis(300);
/// Device profile number of modules, in the lower half of a node's device type.
const MODULES: u32 = 401;

fn scan(given: &GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError> {
    let Where { interface: Some(interface) } = given.read()? else {
        return Err(given.wrong("interface", "it is missing; give the interface of SocketCAN to search: `ip link` lists them"));
    };
    let failed = |error: std::io::Error| DriverError::Failed(format!("interface '{interface}': {error}"));
    let bus = Interface::of(&interface, Vec::new);
    let nodes = Client::open(&bus, ANSWER).and_then(|mut client| client.nodes()).map_err(failed)?;
    let mut client = Client::open(&bus, OBJECT).map_err(failed)?;
    let mut number = |node: u8, index: u16, sub: u8| {
        let value = client.upload(node, Entry { index, sub }).unwrap_or_default();
        (value.iter().take(4).rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte)), value)
    };
    let found = nodes.into_iter().map(|(node, kind)| {
        let (_, name) = number(node, 0x1008, 0);
        let [vendor, product, revision, serial] = [1, 2, 3, 4].map(|sub| number(node, 0x1018, sub).0);
        let name = String::from_utf8_lossy(&name).trim().to_owned();
        let what = format!(
            "node {node}: '{name}', profile {}, vendor {vendor:#010x}, product {product:#010x}, revision {revision:#010x}, serial {serial}",
            kind & 0xFFFF
        );
        let options = if kind & 0xFFFF == MODULES {
            json!({ "interface": interface, "modules": [{ "name": format!("module{node}"), "node": node, "channels": {} }] })
        } else {
            json!({ "interface": interface, "axes": [{ "name": format!("axis{node}"), "node": node, "counts": 1 }] })
        };
        FoundDevice { what, options }
    });
    Ok(found.collect())
}
