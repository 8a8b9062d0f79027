// SPDX-License-Identifier: Apache-2.0
//! Search for servos: tries every ID at every baud rate, on one line or on all lines of this machine.
use super::bus::{Bus, Count};
use super::frame::ID_MAX;
use super::options;
use super::protocol::Protocol;
use super::registers::{Map, Model};
use device::{Counters, DriverError, FoundDevice, GivenOptions};
use serde_json::{Map as Table, Value, json};
use std::sync::Arc;

/// Searches the line set in the options, or every line with an adapter if none is set. Tries the baud rate set in the options, or every
/// rate that servos can have if none is set. A missing ID costs the latency of the adapter: 253 of them take 5 s with an FTDI adapter,
/// whose latency is 20 ms.
pub(super) fn scan(given: &GivenOptions<'_>, protocol: Protocol) -> Result<Vec<FoundDevice>, DriverError> {
    let mut timing = options::timing(given, protocol);
    timing.retries = 0;
    let ports = given.value()["port"].as_str().map_or_else(adapters, |port| vec![port.to_owned()]);
    let bauds = if given.value()["baud"].is_null() { Map::of(protocol).bauds.to_vec() } else { vec![timing.baud] };
    let mut found = Vec::new();
    for port in &ports {
        for baud in &bauds {
            timing.baud = *baud;
            let bus = Bus::open(port, protocol, timing, Arc::new(Counters::new(Count::WORDS)));
            let servos = bus.and_then(|mut bus| present(&mut bus)).map_err(|why| DriverError::Failed(format!("{port} at {baud} baud: {why}")))?;
            if !servos.is_empty() {
                found.push(told(protocol, port, *baud, &servos));
            }
        }
    }
    Ok(found)
}

/// Returns the lines to which an adapter is connected.
fn adapters() -> Vec<String> {
    let files = std::fs::read_dir("/dev").into_iter().flatten().flatten();
    let names = files.filter_map(|file| file.file_name().into_string().ok()).filter(|name| name.starts_with("ttyUSB") || name.starts_with("ttyACM"));
    let mut ports: Vec<String> = names.map(|name| format!("/dev/{name}")).collect();
    ports.sort();
    ports
}

/// Returns the IDs of the servos on the bus, with their model numbers.
fn present(bus: &mut Bus) -> std::io::Result<Vec<(u8, u32)>> {
    let model = Map::of(bus.protocol).model;
    let mut servos = Vec::new();
    // The adapter may echo sent bytes, with or without a servo.
    bus.find_echo(1, model)?;
    for id in 0..=ID_MAX {
        if !bus.ping(id)? {
            continue;
        }
        if let Some(answered) = bus.read(id, model)? {
            servos.push((id, answered.value));
        }
    }
    Ok(servos)
}

fn told(protocol: Protocol, port: &str, baud: u32, servos: &[(u8, u32)]) -> FoundDevice {
    let called: Vec<String> = servos.iter().map(|(id, number)| format!("{} as {id}", Model::called(protocol, *number))).collect();
    let table: Table<String, Value> =
        servos.iter().map(|(id, number)| (format!("servo_{id}"), json!({ "id": id, "model": Model::called(protocol, *number) }))).collect();
    FoundDevice {
        what: format!("{} servos at {baud} baud on {port}: {}", servos.len(), called.join(", ")),
        options: json!({ "port": port, "baud": baud, "servos": table }),
    }
}
