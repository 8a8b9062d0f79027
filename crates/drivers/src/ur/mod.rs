// SPDX-License-Identifier: Apache-2.0
//! Arms of Universal Robots, e-series and later, over RTDE: the joints take positions, 500 times a second.
//!
//! | module | |
//! |---|---|
//! | `rtde`, `sample` | the messages of RTDE, and the values in them |
//! | `link` | the connection, which never waits on the cycle |
//! | `script` | the program that follows on the controller, and stops the arm when no goal arrives |
//! | `dashboard` | requests off the cycle: remote control, power, the release of a protective stop |
//! | `states` | reasons why an arm does not follow, as messages |
//! | `session` | bringing an arm to follow |
//! | `options` | connection to the controller, and manner of following |
//! | `driver` | the exchange |
//! | `any_bytes` | the entry of a fuzzer |
//!
//! The driver is inline. Each firing takes the newest received package and sends one for it, so it may fire more often than the
//! controller. In lockstep a firing waits for the package that is due: virtual time then passes as the controller's does.
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

/// Makes the driver; it connects to the controller when it is opened.
fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    let address = address(&options.host).ok_or_else(|| given.wrong("host", format!("'{}' is neither an address nor the name of a host", options.host)))?;
    let (driver, parts) = driver::Ur::new(options, address);
    Ok((Box::new(driver), json!({ "parts": parts })))
}

fn address(host: &str) -> Option<IpAddr> {
    (host, 0).to_socket_addrs().ok()?.map(|of: SocketAddr| of.ip()).min_by_key(IpAddr::is_ipv6)
}

/// Returns the driver for the virtual clock: a firing waits for the controller, however fast that is.
fn in_lockstep(options: &Value) -> Option<(String, Value)> {
    let mut options = options.clone();
    options.as_object_mut()?.insert("lockstep".to_owned(), Value::Bool(true));
    Some(("ur".to_owned(), options))
}
