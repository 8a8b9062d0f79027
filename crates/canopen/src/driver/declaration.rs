// SPDX-License-Identifier: Apache-2.0
//! The declaration of the driver.
use super::axis::{Axis, part};
use super::counters::COUNTERS;
use super::device::{CanOpen, OBJECT};
use super::options::{self, HEARTBEAT_NS, Options};
use super::services::SERVICES;
use crate::client::Client;
use crate::emulator::DriveOptions;
use crate::link::Place;
use cia402::Entry;
use device::{Class, Declaration, DriverError, Found, Given, Kind, Layout, Life, Opened, OptionWord, Part, SafeBy, SafeState};
use serde::Deserialize;
use serde_json::json;
use std::time::Duration;

/// The driver.
pub static DRIVER: Declaration = Declaration {
    class: Class::Inline,
    life: Life { waits_ns: 0, lost_within_ns: 4 * HEARTBEAT_NS },
    safe_state: SafeState {
        doc: "quick stop: each axis comes to rest along its own ramp and is switched off",
        by: &[SafeBy::Driver, SafeBy::Guard, SafeBy::Device],
        within_ns: 0,
    },
    services: &SERVICES,
    counters: &COUNTERS,
    scan: Some(scan),
    ..Declaration::new("canopen", "drives by CiA 402 on CANopen, an axis each", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 7] = [
    OptionWord::needed("interface", Kind::Text, "the interface of SocketCAN, `can0`; or `local:NAME` of an emulated bus, `emulated` for one of its own"),
    OptionWord::needed(
        "axes",
        Kind::List,
        "a table each: name, node, counts (to a unit of position); and mode, unit, speed_max, range, rated_torque, offset, watchdog",
    ),
    OptionWord::with_default("cycle_ns", Kind::Whole, "10 ms", "the period of the source that exchanges it, as the drives are told").unit("ns"),
    OptionWord::with_default("timeout_ns", Kind::Whole, "100 ms", "the watchdog of the drives: without a heartbeat for so long they stop by themselves")
        .unit("ns"),
    OptionWord::with_default("heartbeat_ns", Kind::Whole, "100 ms", "how often drives say that they are there; the third that is missed loses the device")
        .unit("ns"),
    OptionWord::with_default("lost_after", Kind::Whole, "3", "so many cycles without process data one after another mean that the device is lost"),
    OptionWord::with_default("own_node", Kind::Whole, "127", "the number of this controller on the bus, 1 to 127"),
];

fn open(given: &Given<'_>) -> Result<Opened, DriverError> {
    let options: Options = options::read(given)?;
    let mut layout = Layout::default();
    let axes: Vec<Axis> = options.axes.iter().map(|axis| Axis::new(axis, &mut layout)).collect();
    let parts: Vec<Part> = options.axes.iter().filter_map(part).collect();
    let emulated = || options.axes.iter().map(|axis| DriveOptions { name: axis.name.clone(), node: axis.node, position: 0, watchdog: None }).collect();
    let place = Place::of(&options.interface, emulated);
    Ok((Box::new(CanOpen::new(&options, place, axes, layout.into_channels())), json!({ "parts": parts })))
}

#[derive(Deserialize)]
struct Where {
    interface: Option<String>,
}

/// How long a node may take to say what it is.
const ANSWER: Duration = Duration::from_millis(300);

fn scan(given: &Given<'_>) -> Result<Vec<Found>, DriverError> {
    let Where { interface: Some(interface) } = given.read()? else {
        return Err(given.wrong("interface", "it is missing; give the interface of SocketCAN to look at: `ip link` lists them"));
    };
    let failed = |error: std::io::Error| DriverError::Failed(format!("interface '{interface}': {error}"));
    let place = Place::of(&interface, Vec::new);
    let nodes = Client::open(&place, ANSWER).and_then(|mut client| client.nodes()).map_err(failed)?;
    let mut client = Client::open(&place, OBJECT).map_err(failed)?;
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
        Found { what, options: json!({ "interface": interface, "axes": [{ "name": format!("axis{node}"), "node": node, "counts": 1 }] }) }
    });
    Ok(found.collect())
}
