// SPDX-License-Identifier: Apache-2.0
//! Arms of Universal Robots, e-series and later, over RTDE: its joints take positions, 500 times a second.
//!
//! | module | |
//! |---|---|
//! | `rtde`, `sample` | the messages of RTDE, and the values in them |
//! | `link` | the connection, which never waits on the cycle |
//! | `script` | the program that follows on the controller, and stops the arm when no goal comes |
//! | `dashboard` | what is asked on the side: remote control, power, the release of a protective stop |
//! | `states` | what keeps an arm from following, in words |
//! | `session` | how an arm is brought to follow |
//! | `driver` | the exchange |
//!
//! The driver is inline. Each firing takes the newest package that has come in and sends one for it, so that it may fire more often than the
//! controller does. In lockstep a firing waits for the package that is due: virtual time then passes as the controller's does.
mod dashboard;
mod driver;
mod link;
mod rtde;
mod sample;
mod script;
mod session;
mod states;

use device::{Declaration, DriverError, Given, Kind, Life, Opened, OptionWord, SafeBy, SafeState};
use serde::Deserialize;
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
    counters: &driver::COUNTERS,
    in_virtual_time: Some(in_lockstep),
    ..Declaration::new("ur", "an arm of Universal Robots (e-series and later) over RTDE, which takes positions", &OPTIONS, open)
};

const WAIT_NS: i64 = 10_000_000_000;
const SILENCE_NS: i64 = 100_000_000;
const TIMEOUT_NS: i64 = 40_000_000;

const OPTIONS: [OptionWord; 13] = [
    OptionWord::needed("host", Kind::Text, "name or address of its controller"),
    OptionWord::with_default("rtde_port", Kind::Whole, "30004", "where it offers RTDE"),
    OptionWord::with_default("dashboard_port", Kind::Whole, "29999", "where it offers its dashboard"),
    OptionWord::with_default("script_port", Kind::Whole, "30002", "where it takes programs"),
    OptionWord::with_default("power_on", Kind::Bool, "false", "powers the arm on and releases its brakes when it is opened"),
    OptionWord::with_default("wait_ns", Kind::Whole, "10 s", "how long a controller that is not there yet is waited for").unit("ns"),
    OptionWord::with_default("silence_ns", Kind::Whole, "100 ms", "without a package for so long the arm is lost").unit("ns"),
    OptionWord::with_default("timeout_ns", Kind::Whole, "40 ms", "without a command for so long the controller stops the arm by itself").unit("ns"),
    OptionWord::with_default("speed_max", Kind::Number, "3.14", "no goal is farther from the one before than this speed allows").unit("rad/s"),
    OptionWord::with_default("lookahead", Kind::Number, "0.05", "over how long servoj smooths goals, 0.03 to 0.2").unit("s"),
    OptionWord::with_default("gain", Kind::Number, "300", "how stiffly servoj follows, 100 to 2000"),
    OptionWord::with_default("deceleration", Kind::Number, "5", "with which the controller comes to rest by itself").unit("rad/s^2"),
    OptionWord::with_default("lockstep", Kind::Bool, "false; true under the virtual clock", "a firing waits for the package that is due"),
];

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Options {
    host: String,
    rtde_port: u16,
    dashboard_port: u16,
    script_port: u16,
    power_on: bool,
    wait_ns: i64,
    silence_ns: i64,
    timeout_ns: i64,
    speed_max: f64,
    lookahead: f64,
    gain: f64,
    deceleration: f64,
    lockstep: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            host: String::new(),
            rtde_port: rtde::PORT,
            dashboard_port: dashboard::PORT,
            script_port: 30002,
            power_on: false,
            wait_ns: WAIT_NS,
            silence_ns: SILENCE_NS,
            timeout_ns: TIMEOUT_NS,
            speed_max: std::f64::consts::PI,
            lookahead: 0.05,
            gain: 300.0,
            deceleration: 5.0,
            lockstep: false,
        }
    }
}

/// Makes the driver; the controller is looked for when it is opened.
fn open(given: &Given<'_>) -> Result<Opened, DriverError> {
    let options: Options = given.read()?;
    let within = |option: &str, value: f64, least: f64, most: f64| {
        if (least..=most).contains(&value) { Ok(()) } else { Err(given.wrong(option, format!("{least} to {most} is asked for"))) }
    };
    within("lookahead", options.lookahead, 0.03, 0.2)?;
    within("gain", options.gain, 100.0, 2000.0)?;
    within("speed_max", options.speed_max, 0.001, 10.0)?;
    within("deceleration", options.deceleration, 0.1, 100.0)?;
    for (option, value, least) in
        [("wait_ns", options.wait_ns, 0), ("silence_ns", options.silence_ns, 4_000_000), ("timeout_ns", options.timeout_ns, 4_000_000)]
    {
        if !(least..=3_600_000_000_000).contains(&value) {
            return Err(given.wrong(option, format!("{} ms to an hour is asked for", least / 1_000_000)));
        }
    }
    let address = address(&options.host).ok_or_else(|| given.wrong("host", format!("'{}' is neither an address nor the name of a host", options.host)))?;
    let (driver, parts) = driver::Ur::new(options, address);
    Ok((Box::new(driver), json!({ "parts": parts })))
}

fn address(host: &str) -> Option<IpAddr> {
    (host, 0).to_socket_addrs().ok()?.map(|of: SocketAddr| of.ip()).min_by_key(IpAddr::is_ipv6)
}

/// Under the virtual clock a firing waits for the controller, however fast that is.
fn in_lockstep(options: &Value) -> Option<(String, Value)> {
    let mut options = options.clone();
    options.as_object_mut()?.insert("lockstep".to_owned(), Value::Bool(true));
    Some(("ur".to_owned(), options))
}
