// SPDX-License-Identifier: Apache-2.0
//! Declaration of the driver: its manual, how it is created, and the search for subdevices.
use super::axis::Axis;
use super::counters::Count;
use super::device::EtherCat;
use super::entries::{NamedEntry, of_eeprom, of_pdos};
use super::options::{OPTIONS, Options, TIMEOUT_NS, TerminalOptions, check};
use super::services::SERVICES;
use super::terminal::Terminal;
use crate::main_device::{Bus, inventory};
use crate::sii::Contents;
use cia402::axis::part;
use device::{Class, Declaration, DriverError, FoundDevice, GivenOptions, Layout, Life, OpenedDriver, Part, SafeBy, SafeState};
use serde::Deserialize;
use serde_json::{Value, json};

/// Declaration of the driver `ethercat`.
pub static DRIVER: Declaration = Declaration {
    class: Class::Inline,
    life: Life { waits_ns: 0, lost_within_ns: 0 },
    safe_state: SafeState {
        doc: "quick stop: each axis comes to rest and is switched off; outputs of terminals take their safe values",
        by: &[SafeBy::Driver, SafeBy::Device],
        within_ns: 0,
    },
    services: &SERVICES,
    counters: Count::WORDS,
    rights: &["raw frames on a network interface: cap_net_raw"],
    scan: Some(scan),
    in_virtual_time: Some(in_lockstep),
    ..Declaration::new("ethercat", "CiA 402 drives on EtherCAT, one axis each, and terminals of inputs and outputs", &OPTIONS, open)
};

fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    check(given, &options)?;
    let timeout_ns = options.timeout_ns.unwrap_or(TIMEOUT_NS);
    let mut layout = Layout::default();
    let (sync0, lockstep) = (options.sync0(), options.lockstep);
    let axes: Vec<Axis> = options.axes.iter().enumerate().map(|(index, axis)| Axis::new(axis, index, &mut layout)).collect();
    let terminals = terminals(given, &options, &mut layout)?;
    let parts: Vec<Part> = options.axes.iter().filter_map(|of| part(&of.axis)).collect();
    let driver =
        EtherCat::new(options.interface, axes, layout.into_channels(), timeout_ns, options.lost_after.unwrap_or(3).max(1), sync0).with_terminals(terminals);
    let driver = if lockstep { driver.in_lockstep() } else { driver };
    Ok((Box::new(driver), json!({ "parts": parts })))
}

/// Returns the terminals with their channels, described by the vendors' files or else by the EEPROMs, which are then read.
fn terminals(given: &GivenOptions<'_>, options: &Options, layout: &mut Layout) -> Result<Vec<Terminal>, DriverError> {
    let is_asked = options.terminals.iter().any(|of| of.pdos.is_none());
    let found = if is_asked { Bus::open(&options.interface).and_then(|mut bus| inventory(&mut bus)).map_err(DriverError::Failed)? } else { Vec::new() };
    let made = options.terminals.iter().map(|of| Terminal::new(of, &named(of, &found)?, layout).map_err(|problem| given.wrong("terminals", problem)));
    made.collect()
}

fn named(of: &TerminalOptions, found: &[Contents]) -> Result<Vec<NamedEntry>, DriverError> {
    match (&of.pdos, found.get(of.at)) {
        (Some(pdos), _) => Ok(of_pdos(pdos)),
        (None, Some(contents)) => Ok(of_eeprom(contents)),
        (None, None) => {
            let (name, at, count) = (&of.name, of.at, found.len());
            Err(DriverError::Failed(format!(
                "terminal '{name}' should be at place {at}, but {count} subdevices answer; check the cables and the power after the last of them"
            )))
        }
    }
}

/// Returns the driver for the virtual clock, under which a firing waits for its frame however slow the segment is, and no watchdog
/// expires, because no watchdog time elapses.
fn in_lockstep(options: &Value) -> Option<(String, Value)> {
    let mut options = options.clone();
    options.as_object_mut()?.insert("lockstep".to_owned(), Value::Bool(true));
    Some(("ethercat".to_owned(), options))
}

#[derive(Deserialize)]
struct Where {
    interface: Option<String>,
}

fn scan(given: &GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError> {
    let Where { interface: Some(interface) } = given.read()? else {
        return Err(given.wrong("interface", "it is missing; give the network interface to search: `ip link` lists them"));
    };
    let found = Bus::open(&interface).and_then(|mut bus| inventory(&mut bus)).map_err(DriverError::Failed)?;
    Ok(found.iter().enumerate().map(|(position, contents)| tell(&interface, position, contents)).collect())
}

/// Returns the subdevice at a position, and the options to serve it. It is served as a terminal if its EEPROM lists entries and none of
/// them belongs to a drive.
fn tell(interface: &str, position: usize, contents: &Contents) -> FoundDevice {
    const CONTROL_WORD: u16 = 0x6040;
    let identity = &contents.identity;
    let (vendor, product, revision) = (identity.vendor, identity.product, identity.revision);
    let alias = if identity.alias == 0 { String::new() } else { format!(", alias {}", identity.alias) };
    let entries = of_eeprom(contents);
    let is_drive = if entries.is_empty() { contents.has_coe } else { entries.iter().any(|entry| entry.of.index == CONTROL_WORD) };
    let channels = match (is_drive, entries.len()) {
        (true, _) => String::new(),
        (false, 0) => "; a coupler, without process data".to_owned(),
        (false, _) => format!("; channels {}", entries.iter().map(|entry| entry.name.as_str()).collect::<Vec<_>>().join(", ")),
    };
    let what = format!(
        "{position}: '{}', vendor {vendor:#010x}, product {product:#010x}, revision {revision:#010x}, serial {}{alias}{channels}",
        identity.name, identity.serial
    );
    let options = match (is_drive, entries.is_empty()) {
        (true, _) => json!({ "interface": interface, "axes": [{ "name": format!("axis{position}"), "at": position, "counts": 1 }] }),
        (false, false) => json!({ "interface": interface, "terminals": [{ "name": format!("terminal{position}"), "at": position }] }),
        (false, true) => json!({ "interface": interface }),
    };
    FoundDevice { what, options }
}
