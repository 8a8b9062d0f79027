// SPDX-License-Identifier: Apache-2.0
//! Searches for Modbus devices: units on a serial line, or devices at a list of TCP addresses.
use super::link::{Fault, Link, address_of};
use super::pdu::{Exception, Request};
use super::services;
use crate::stream::Address;
use device::{DriverError, FoundDevice, GivenOptions};
use serde_json::json;
use std::time::Duration;

/// Default time limit for an answer; with it, a line of 247 units is searched in 25 s.
const ANSWER: Duration = Duration::from_millis(100);
/// Default time limit over TCP, which is longer because a device may be behind a gateway.
const ANSWER_TCP: Duration = Duration::from_millis(500);

/// Searches `address`, a serial line or TCP addresses separated by commas; `unit` restricts the search to that unit.
pub(super) fn scan(given: &GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError> {
    let value = given.value();
    let Some(asked) = value["address"].as_str() else {
        return Err(given.wrong("address", "give the place to search: a serial line, or TCP addresses separated by commas"));
    };
    let only = value["unit"].as_u64().and_then(|unit| u8::try_from(unit).ok());
    let answer = value["answer_ns"].as_u64().map(Duration::from_nanos);
    let mut found = Vec::new();
    for text in asked.split(',').map(str::trim).filter(|text| !text.is_empty()) {
        let address = address_of(text).map_err(|why| given.wrong("address", why))?;
        let (units, answer) = match &address {
            Address::Serial { .. } => (only.map_or(1..=247, |unit| unit..=unit), answer.unwrap_or(ANSWER)),
            // A stand-alone device answers to any unit; the most common setting is tried.
            Address::Tcp(_) => (only.unwrap_or(1)..=only.unwrap_or(1), answer.unwrap_or(ANSWER_TCP)),
        };
        for unit in units {
            let link = Link::new(&address, unit, answer, 0).map_err(|why| given.wrong("address", why))?;
            match link.ask_once(&Request::Identify { from: 0 }) {
                Ok(_) => found.push(FoundDevice { what: named(&link, unit), options: json!({ "address": text, "unit": unit }) }),
                // A gateway without a device behind it.
                Err(Fault::Exception(Exception(10 | 11))) => {}
                Err(Fault::Exception(_)) => found.push(FoundDevice { what: format!("Modbus unit {unit}"), options: json!({ "address": text, "unit": unit }) }),
                Err(Fault::Broken(why)) if matches!(address, Address::Serial { .. }) => return Err(given.wrong("address", format!("{address}: {why}"))),
                Err(Fault::Broken(_)) => break,
                Err(Fault::Timeout(_) | Fault::Damaged(_)) => {}
            }
        }
    }
    Ok(found)
}

fn named(link: &Link, unit: u8) -> String {
    let said = services::identification(link).unwrap_or_default();
    let words: Vec<&str> = ["vendor", "product_code", "version"].iter().filter_map(|word| said[*word].as_str()).collect();
    format!("Modbus unit {unit}: {}", words.join(" "))
}
