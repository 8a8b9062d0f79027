// SPDX-License-Identifier: Apache-2.0
//! Servos on a serial bus, as in arms built by students: Feetech STS and Dynamixel 2.0. Each is a joint that takes goals in rad.
//!
//! | module | |
//! |---|---|
//! | `frame`, `sts`, `dynamixel2` | frames of the two protocols: arbitrary bytes may arrive, and nothing is allocated |
//! | `protocol` | common interface of the two |
//! | `registers` | registers of a servo, and the interpretation of their values |
//! | `bus` | one request at a time: its time limit, its echo, its retries |
//! | `driver`, `arming`, `watchdog` | the exchange; torque, which is switched on at the current position; the stop of a servo without communication |
//! | `options`, `calibration` | assignment of servos to joints, zeros and range ends |
//! | `any_bytes` | the entry point of a fuzzer |
//! | `services`, `scan` | registers, calibration and the search, off the cycle |
//!
//! These are two kinds rather than one with an option, because the owner of a bus knows the manufacturer of its servos, and the search
//! for IDs, baud rates and models depends on it.
pub(crate) mod any_bytes;
mod arming;
mod bus;
mod calibration;
mod driver;
mod dynamixel2;
mod frame;
mod options;
mod protocol;
mod registers;
mod scan;
mod services;
mod sts;
#[cfg(test)]
mod tests;
mod watchdog;

use device::{Class, Declaration, DriverError, GivenOptions, Life, OpenedDriver, OptionWord, SafeBy, SafeState};
use protocol::Protocol;

pub(crate) static FEETECH: Declaration = of(
    "feetech",
    "Feetech STS servos on a serial bus",
    TORQUE_OFF,
    &options::FEETECH,
    |given| open(given, Protocol::Sts),
    |given| scan::scan(given, Protocol::Sts),
);

pub(crate) static DYNAMIXEL: Declaration = of(
    "dynamixel",
    "Dynamixel servos (protocol 2.0) on a serial bus",
    SafeState {
        doc: "torque off: an arm that nothing holds sinks; with option watchdog_ns a servo that gets no request stands still by itself, with its torque on",
        ..TORQUE_OFF
    },
    &options::DYNAMIXEL,
    |given| open(given, Protocol::Dynamixel),
    |given| scan::scan(given, Protocol::Dynamixel),
);

const TORQUE_OFF: SafeState = SafeState { doc: "torque off: an arm that nothing holds sinks", by: &[SafeBy::Driver, SafeBy::Guard], within_ns: 500_000_000 };

const fn of(
    kind: &'static str,
    doc: &'static str,
    safe_state: SafeState,
    options: &'static [OptionWord],
    open: device::Of<OpenedDriver>,
    scan: device::Scan,
) -> Declaration {
    Declaration {
        class: Class::Worker,
        life: Life { waits_ns: 0, lost_within_ns: 500_000_000 },
        safe_state,
        services: &services::SERVICES,
        counters: bus::Count::WORDS,
        rights: &["the serial line: be a member of group dialout"],
        scan: Some(scan),
        ..Declaration::new(kind, doc, options, open)
    }
}

fn open(given: &GivenOptions<'_>, protocol: Protocol) -> Result<OpenedDriver, DriverError> {
    Ok(driver::Servos::made(options::read(given, protocol)?, protocol))
}
