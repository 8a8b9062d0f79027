// SPDX-License-Identifier: Apache-2.0
//! The declaration of the driver: its manual, how it is made, the search for subdevices.
use super::axis::Axis;
use super::counters::Count;
use super::device::EtherCat;
use super::options::{OPTIONS, Options, TIMEOUT_NS, check};
use super::services::SERVICES;
use crate::main_device::{Bus, inventory};
use cia402::axis::part;
use device::{Class, Declaration, DriverError, Found, Given, Layout, Life, Opened, Part, SafeBy, SafeState};
use serde::Deserialize;
use serde_json::{Value, json};

/// The driver.
pub static DRIVER: Declaration = Declaration {
    class: Class::Inline,
    life: Life { waits_ns: 0, lost_within_ns: 0 },
    safe_state: SafeState { doc: "quick stop: each axis comes to rest and is switched off", by: &[SafeBy::Driver, SafeBy::Device], within_ns: 0 },
    services: &SERVICES,
    counters: Count::WORDS,
    rights: &["raw frames on a network interface: cap_net_raw"],
    scan: Some(scan),
    in_virtual_time: Some(in_lockstep),
    ..Declaration::new("ethercat", "drives by CiA 402 on EtherCAT, an axis each", &OPTIONS, open)
};

fn open(given: &Given<'_>) -> Result<Opened, DriverError> {
    let options: Options = given.read()?;
    check(given, &options)?;
    let timeout_ns = options.timeout_ns.unwrap_or(TIMEOUT_NS);
    let mut layout = Layout::default();
    let (sync0, lockstep) = (options.sync0(), options.lockstep);
    let axes: Vec<Axis> = options.axes.iter().enumerate().map(|(index, axis)| Axis::new(axis, index, &mut layout)).collect();
    let parts: Vec<Part> = options.axes.iter().filter_map(|of| part(&of.axis)).collect();
    let driver = EtherCat::new(options.interface, axes, layout.into_channels(), timeout_ns, options.lost_after.unwrap_or(3).max(1), sync0);
    let driver = if lockstep { driver.in_lockstep() } else { driver };
    Ok((Box::new(driver), json!({ "parts": parts })))
}

/// Under the virtual clock a firing waits for its frame, however fast the segment is; time that does not pass there trips no watchdog.
fn in_lockstep(options: &Value) -> Option<(String, Value)> {
    let mut options = options.clone();
    options.as_object_mut()?.insert("lockstep".to_owned(), Value::Bool(true));
    Some(("ethercat".to_owned(), options))
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
        let alias = if identity.alias == 0 { String::new() } else { format!(", alias {}", identity.alias) };
        let what = format!(
            "{position}: '{}', vendor {vendor:#010x}, product {product:#010x}, revision {revision:#010x}, serial {}{alias}",
            identity.name, identity.serial
        );
        Found { what, options: json!({ "interface": interface, "axes": [{ "name": format!("axis{position}"), "at": position, "counts": 1 }] }) }
    });
    Ok(found.collect())
}
