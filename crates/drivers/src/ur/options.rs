// SPDX-License-Identifier: Apache-2.0
//! Options of a Universal Robots arm: connection to the controller, and parameters of following.
use super::{dashboard, rtde};
use device::{Kind, OptionWord};
use serde::Deserialize;

pub(super) const WAIT_NS: i64 = 10_000_000_000;
/// Default for the maximum waiting time with `power_on`.
const WAIT_FOR_POWER_NS: i64 = 70_000_000_000;
pub(super) const SILENCE_NS: i64 = 100_000_000;
const TIMEOUT_NS: i64 = 40_000_000;
const HOUR_NS: f64 = 3.6e12;

pub(super) const OPTIONS: [OptionWord; 13] = [
    OptionWord::needed("host", Kind::Text, "name or address of its controller"),
    OptionWord::with_default("rtde_port", Kind::Whole, "30004", "port of its RTDE server").within(1.0, 65535.0),
    OptionWord::with_default("dashboard_port", Kind::Whole, "29999", "port of its dashboard").within(1.0, 65535.0),
    OptionWord::with_default("script_port", Kind::Whole, "30002", "port that accepts programs").within(1.0, 65535.0),
    OptionWord::with_default("power_on", Kind::Bool, "false", "powers the arm on and releases its brakes when it is opened"),
    OptionWord::with_default("wait_ns", Kind::Whole, "10 s; 70 s with power_on", "time limit until the arm follows, including the start of a controller")
        .unit("ns")
        .within(0.0, HOUR_NS),
    OptionWord::with_default("silence_ns", Kind::Whole, "100 ms", "time without a package before the arm is lost").unit("ns").within(4e6, HOUR_NS),
    OptionWord::with_default("timeout_ns", Kind::Whole, "40 ms", "time without a command before the controller stops the arm by itself")
        .unit("ns")
        .within(4e6, HOUR_NS),
    OptionWord::with_default("speed_max", Kind::Number, "3.14", "maximum speed from one goal to the next").unit("rad/s").within(0.001, 10.0),
    OptionWord::with_default("lookahead", Kind::Number, "0.05", "time over which servoj smooths goals").unit("s").within(0.03, 0.2),
    OptionWord::with_default("gain", Kind::Number, "300", "stiffness with which servoj follows").within(100.0, 2000.0),
    OptionWord::with_default("deceleration", Kind::Number, "5", "deceleration with which the controller comes to rest by itself")
        .unit("rad/s^2")
        .within(0.1, 100.0),
    OptionWord::with_default("lockstep", Kind::Bool, "false; true under the virtual clock", "whether a firing waits for the package that is due"),
];

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Options {
    pub(super) host: String,
    pub(super) rtde_port: u16,
    pub(super) dashboard_port: u16,
    pub(super) script_port: u16,
    pub(super) power_on: bool,
    pub(super) wait_ns: Option<i64>,
    pub(super) silence_ns: i64,
    pub(super) timeout_ns: i64,
    pub(super) speed_max: f64,
    pub(super) lookahead: f64,
    pub(super) gain: f64,
    pub(super) deceleration: f64,
    pub(super) lockstep: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            host: String::new(),
            rtde_port: rtde::PORT,
            dashboard_port: dashboard::PORT,
            script_port: 30002,
            power_on: false,
            wait_ns: None,
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

impl Options {
    /// Returns the maximum time to wait until the arm follows, ns.
    pub(super) fn wait_ns(&self) -> i64 {
        self.wait_ns.unwrap_or(if self.power_on { WAIT_FOR_POWER_NS } else { WAIT_NS })
    }
}
