// SPDX-License-Identifier: Apache-2.0
//! Modbus over TCP and serial lines: a device whose registers are channels.
//!
//! | module | |
//! |---|---|
//! | `pdu` | requests, answers and exceptions |
//! | `frame` | the frames around them: MBAP on TCP, CRC on a serial line |
//! | `value` | numbers in registers: widths, byte orders, scales |
//! | `map` | the locations of channels, and the minimum number of requests that read them |
//! | `turn`, `link` | a request and its answer; units on one line take turns |
//! | `client` | the driver |
//! | `server` | the other side: channels of this machine, offered to clients |
//! | `any_bytes` | the entry point of a fuzzer |
//! | `services`, `scan` | single registers, identification; the search for units |
pub(crate) mod any_bytes;
mod client;
#[cfg(test)]
mod codec_tests;
mod frame;
mod link;
mod map;
mod pdu;
mod scan;
pub(crate) mod server;
mod services;
mod turn;
mod value;

use crate::stream::Address;
use device::{Class, Declaration, DriverError, GivenOptions, Kind, Life, OpenedDriver, OptionWord, SafeBy, SafeState};
use link::{Link, address_of};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::time::Duration;

pub(crate) static DRIVER: Declaration = Declaration {
    class: Class::Worker,
    life: Life { waits_ns: 0, lost_within_ns: 2_000_000_000 },
    safe_state: SafeState {
        doc: "each output carries its safe value, as long as the device answers; set its own watchdog in case it is cut off",
        by: &[SafeBy::Driver],
        within_ns: 1_000_000_000,
    },
    services: &services::SERVICES,
    counters: link::Count::WORDS,
    rights: &["serial line: member of the group that owns it, dialout on Debian"],
    scan: Some(scan::scan),
    ..Declaration::new("modbus", "a Modbus device over TCP or a serial line: registers and coils as channels", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 6] = [
    OptionWord::needed("address", Kind::Text, "tcp/192.0.2.5:502, or rtu//dev/ttyUSB0?baud=19200&parity=even; units on one line share it"),
    OptionWord::needed(
        "channels",
        Kind::Table,
        "for each name: holding, input, coil or discrete with its address, type, order, scale, offset, bit, byte, raw, unit, write, safe, slew, every_ns",
    )
    .entries(&[&map::CHANNEL]),
    OptionWord::with_default("unit", Kind::Whole, "1", "the device on a line or behind a gateway").within(0.0, 255.0),
    OptionWord::with_default("answer_ns", Kind::Whole, "0.5 s", "time limit for an answer").unit("ns").within(1e6, 6e10),
    OptionWord::with_default("retries", Kind::Whole, "2", "number of repeated requests before the device is lost").within(0.0, 100.0),
    OptionWord::with_default("gap", Kind::Whole, "0", "maximum number of unused registers between two that one request reads; some devices refuse them")
        .within(0.0, 124.0),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    address: String,
    channels: Map<String, Value>,
    #[serde(default = "first_unit")]
    unit: u8,
    #[serde(default = "half_a_second")]
    answer_ns: u64,
    #[serde(default = "twice")]
    retries: u32,
    #[serde(default)]
    gap: u16,
}

fn first_unit() -> u8 {
    1
}

fn half_a_second() -> u64 {
    500_000_000
}

fn twice() -> u32 {
    2
}

fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    let address = address_of(&options.address).map_err(|why| given.wrong("address", why))?;
    if matches!(address, Address::Serial { .. }) && !(1..=247).contains(&options.unit) {
        return Err(given.wrong("unit", "a unit on a serial line must be 1 to 247"));
    }
    let (channels, places) = map::places(&options.channels, map::End::Client).map_err(|why| given.wrong("channels", why))?;
    let link = Link::new(&address, options.unit, Duration::from_nanos(options.answer_ns), options.retries).map_err(|why| given.wrong("address", why))?;
    Ok((Box::new(client::Client::new(channels, &places, link, options.gap)), json!({ "parts": [] })))
}
