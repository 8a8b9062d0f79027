// SPDX-License-Identifier: Apache-2.0
//! Arms of Universal Robots, e-series and later, over RTDE: the joints take positions, 500 times per second.
//!
//! | module | |
//! |---|---|
//! | `rtde`, `sample` | the messages of RTDE, and the values in them |
//! | `link` | the connection, which never blocks on the cycle |
//! | `script` | the program on the controller, which follows goals and stops the arm when none arrives |
//! | `dashboard` | requests off the cycle: remote control, power, the release of a protective stop |
//! | `states` | reasons why an arm does not follow, as messages |
//! | `session` | start-up of an arm until it follows |
//! | `options` | connection to the controller, and parameters of following |
//! | `driver` | the exchange |
//! | `any_bytes` | the entry point of a fuzzer |
//!
//! The driver is inline. Each firing takes the newest received package and sends one in return, so the driver may fire more often than
//! the controller. In lockstep, a firing waits for the package that is due, so that virtual time elapses as the controller's does.
pub(crate) mod any_bytes;
mod dashboard;
mod driver;
mod link;
mod options;
mod rtde;
mod sample;
mod script;
mod session;
mod states;

use device::{Declaration, DriverError, GivenOptions, Life, OpenedDriver, SafeBy, SafeState};
use options::{OPTIONS, Options, SILENCE_NS, WAIT_NS};
use serde_json::{Value, json};
use std::net::{IpAddr, SocketAddr, ToSocketAddrs};

pub(crate) static DRIVER: Declaration = Declaration {
    life: Life { waits_ns: WAIT_NS, lost_within_ns: SILENCE_NS },
    safe_state: SafeState {
        doc: "the arm comes to rest and is held by its controller; digital outputs that were commanded are off",
        by: &[SafeBy::Driver, SafeBy::Device],
        within_ns: 1_000_000_000,
    },
    services: &dashboard::SERVICES,
    counters: driver::Count::WORDS,
    in_virtual_time: Some(in_lockstep),
    ..Declaration::new("ur", "an arm of Universal Robots (e-series and later) over RTDE, commanded by positions", &OPTIONS, open)
};

/// Creates the driver, which connects to the controller when it is opened.
fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    let address = address(&options.host).ok_or_else(|| given.wrong("host", format!("'{}' is neither an address nor the name of a host", options.host)))?;
    let (driver, parts) = driver::Ur::new(options, address);
    Ok((Box::new(driver), json!({ "parts": parts })))
}

fn address(host: &str) -> Option<IpAddr> {
    (host, 0).to_socket_addrs().ok()?.map(|of: SocketAddr| of.ip()).min_by_key(IpAddr::is_ipv6)
}

/// Returns the driver for the virtual clock, in which a firing waits for the controller, however fast it is.
fn in_lockstep(options: &Value) -> Option<(String, Value)> {
    let mut options = options.clone();
    options.as_object_mut()?.insert("lockstep".to_owned(), Value::Bool(true));
    Some(("ur".to_owned(), options))
}
