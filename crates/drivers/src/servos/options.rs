// SPDX-License-Identifier: Apache-2.0
//! Options of a servo bus, and the joints that they define.
use super::bus::{SERVOS_MAX, Timing};
use super::calibration::{self, Calibration};
use super::frame::ID_MAX;
use super::protocol::Protocol;
use super::registers::{Map, Model, TURN, WATCHDOG_UNIT_NS, WATCHDOG_UNITS_MAX};
use device::{DriverError, GivenOptions, Kind, OptionWord, Reach};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::Duration;

/// Default maximum speed of a goal, rad/s.
const SPEED: f64 = 3.0;

const COMMON: [OptionWord; 8] = [
    OptionWord::needed("port", Kind::Text, "the serial line: /dev/ttyUSB0, or a link in /dev/serial/by-id"),
    OptionWord::with_default("baud", Kind::Whole, "1000000 (Feetech), 57600 (Dynamixel)", "baud rate").unit("1/s").within(1_200.0, 1e7),
    OptionWord::with_default(
        "servos",
        Kind::Table,
        "those of the calibration",
        "name: {id, model, min (rad), max (rad), direction (1 or -1), zero (counts)} for each joint",
    )
    .entries(&[&SERVO]),
    OptionWord::with_default("calibration", Kind::Text, "none", "a file of zeros and ranges, in the format of lerobot").reaches(Reach::File),
    OptionWord::with_default("max_speed", Kind::Number, "3 rad/s", "maximum speed of a goal, whatever is commanded").unit("rad/s").above(0.0, 100.0),
    OptionWord::with_default("retries", Kind::Whole, "2", "number of repeated requests to a servo that does not answer").within(0.0, 100.0),
    OptionWord::with_default("latency_ns", Kind::Whole, "20 ms", "time that adapter and host may take in addition to the time on the wire")
        .unit("ns")
        .within(0.0, 6e10),
    OptionWord::with_default("echo", Kind::Bool, "tried when it is opened", "whether the adapter echoes what it sends"),
];

/// Numeric options of a joint.
const SERVO: [OptionWord; 5] = [
    OptionWord::with_default("id", Kind::Whole, "that of the calibration", "its number on the line").within(0.0, ID_MAX as f64),
    OptionWord::with_default("min", Kind::Number, "that of the calibration", "its minimum").unit("rad").within(-MANY_TURNS, MANY_TURNS),
    OptionWord::with_default("max", Kind::Number, "that of the calibration", "its maximum").unit("rad").within(-MANY_TURNS, MANY_TURNS),
    OptionWord::with_default("direction", Kind::Number, "1", "1 or -1").within(-1.0, 1.0),
    OptionWord::with_default("zero", Kind::Number, "the middle of a turn", "counts at 0 rad").within(-1e6, 1e6),
];

/// Maximum angle that the registers of servos can represent, rad.
const MANY_TURNS: f64 = 256.0 * TAU;

pub(super) static FEETECH: [OptionWord; 8] = COMMON;

pub(super) static DYNAMIXEL: [OptionWord; 9] = {
    let [port, baud, servos, calibration, max_speed, retries, latency, echo] = COMMON;
    let doc = "a servo with torque stands still by itself after this time without a request on the line: 20 ms to 2.54 s, in steps of 20 ms";
    let watchdog = OptionWord::with_default("watchdog_ns", Kind::Whole, "none", doc).unit("ns").within(2e7, 2.54e9);
    [port, baud, servos, calibration, max_speed, retries, latency, echo, watchdog]
};

/// Options that describe the devices on the line; the others are read by [`timing`].
#[derive(Deserialize)]
struct Options {
    port: String,
    #[serde(default)]
    servos: BTreeMap<String, Servo>,
    calibration: Option<PathBuf>,
    max_speed: Option<f64>,
    watchdog_ns: Option<i64>,
}

#[derive(Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Servo {
    id: Option<u8>,
    model: Option<String>,
    min: Option<f64>,
    max: Option<f64>,
    direction: Option<f64>,
    zero: Option<f64>,
}

/// Options with which a bus is opened.
pub(super) struct ServoBusOptions {
    pub(super) port: String,
    pub(super) timing: Timing,
    pub(super) max_speed: f64,
    /// Timeout of the watchdog in units of the servo's register.
    pub(super) watchdog: Option<u8>,
    pub(super) joints: Vec<WiredJoint>,
}

/// A joint as wired: its servo, and the conversion of its counts to an angle.
#[derive(Clone, Debug)]
pub(super) struct WiredJoint {
    pub(super) name: String,
    pub(super) id: u8,
    pub(super) model: &'static Model,
    pub(super) direction: f64,
    /// Counts at 0 rad.
    pub(super) zero: f64,
    /// Range, rad.
    pub(super) min: f64,
    pub(super) max: f64,
    /// Required offset in the servo itself; `None` if any is accepted.
    pub(super) homing_offset: Option<i64>,
}

impl WiredJoint {
    pub(super) fn angle(&self, counts: f64) -> f64 {
        self.direction * (counts - self.zero) * TAU / TURN
    }

    pub(super) fn counts(&self, angle: f64) -> f64 {
        self.zero + self.direction * angle * TURN / TAU
    }
}

/// Default maximum delay of adapter and host. FTDI adapters hold received bytes for up to 16 ms.
const LATENCY: Duration = Duration::from_millis(20);

/// Returns the timing of the line as set by the options.
pub(super) fn timing(given: &GivenOptions<'_>, protocol: Protocol) -> Timing {
    let whole = |name: &str| given.value()[name].as_u64();
    let narrow = |name: &str| whole(name).and_then(|value| u32::try_from(value).ok());
    let baud = narrow("baud").unwrap_or(Map::of(protocol).bauds[0]);
    let retries = narrow("retries").unwrap_or(2);
    let latency = whole("latency_ns").map_or(LATENCY, Duration::from_nanos);
    Timing { baud, latency, retries, echo: given.value()["echo"].as_bool() }
}

/// Reads the options, and the calibration to which they refer.
pub(super) fn read(given: &GivenOptions<'_>, protocol: Protocol) -> Result<ServoBusOptions, DriverError> {
    let timing = timing(given, protocol);
    let options: Options = given.read()?;
    let max_speed = options.max_speed.unwrap_or(SPEED);
    let watchdog = options.watchdog_ns.map(|ns| units(ns).ok_or_else(|| given.wrong("watchdog_ns", "it must be 20 ms to 2.54 s, in steps of 20 ms")));
    let watchdog = watchdog.transpose()?;
    let calibration = match &options.calibration {
        Some(path) => calibration::read(path).map_err(|problem| given.wrong("calibration", format!("{}: {problem}", path.display())))?,
        None => Calibration::default(),
    };
    let mut servos = options.servos.clone();
    if servos.is_empty() {
        servos.extend(calibration.keys().map(|name| (name.clone(), Servo::default())));
    }
    let mut joints: Vec<WiredJoint> = Vec::new();
    for (name, servo) in &servos {
        let joint = wired(name, servo, &calibration, protocol).map_err(|(option, problem)| given.wrong(&format!("servos.{name}{option}"), problem))?;
        if let Some(other) = joints.iter().find(|other| other.id == joint.id) {
            return Err(given.wrong(&format!("servos.{name}.id"), format!("'{name}' and '{}' have the same id, {}", other.name, joint.id)));
        }
        joints.push(joint);
    }
    joints.sort_by_key(|joint| joint.id);
    match joints.len() {
        0 => Err(given.wrong("servos", "it is missing; give name: {\"id\": 1} for each joint, or a calibration; a scan finds ids")),
        1..=SERVOS_MAX => Ok(ServoBusOptions { port: options.port, timing, max_speed, watchdog, joints }),
        more => Err(given.wrong("servos", format!("there cannot be {more} servos; give at most {SERVOS_MAX} for one line"))),
    }
}

/// Converts a time to units of the servo's register; `None` if it cannot be represented.
fn units(ns: i64) -> Option<u8> {
    u8::try_from(ns / WATCHDOG_UNIT_NS).ok().filter(|units| ns % WATCHDOG_UNIT_NS == 0 && (1..=WATCHDOG_UNITS_MAX).contains(&i64::from(*units)))
}

/// Returns the joint. The error contains the wrong option of the servo, preceded by a dot, and the reason.
fn wired(name: &str, servo: &Servo, calibration: &Calibration, protocol: Protocol) -> Result<WiredJoint, (&'static str, String)> {
    let entry = calibration.get(name);
    if entry.is_none() && !calibration.is_empty() {
        return Err(("", format!("the calibration has no such joint; {}", hints::did_you_mean(name, calibration.keys().map(String::as_str)))));
    }
    if let (Protocol::Sts, Some(entry)) = (protocol, entry) {
        let counts = 0.0..=TURN - 1.0;
        if !(counts.contains(&entry.range_min) && counts.contains(&entry.range_max)) {
            let range = format!("{} to {}", entry.range_min, entry.range_max);
            return Err(("", format!("its range in the calibration is {range}, but its encoder counts 0 to {}; record it again", TURN - 1.0)));
        }
    }
    let id = servo.id.or(entry.map(|entry| entry.id)).ok_or((".id", "it is missing; run a scan to find ids".to_owned()))?;
    if let Some(entry) = entry.filter(|entry| entry.id != id) {
        return Err((".id", format!("it is {id} here but {} in the calibration", entry.id)));
    }
    let models = Model::all(protocol);
    let model = match &servo.model {
        None => models.last().ok_or((".model", "there are no models".to_owned()))?,
        Some(called) => models.iter().find(|model| model.name == called.as_str()).ok_or_else(|| {
            let known: Vec<&str> = models.iter().map(|model| model.name).collect();
            (".model", format!("there is no model '{called}'; the models are {}", known.join(", ")))
        })?,
    };
    let direction = servo.direction.or(entry.map(|entry| entry.direction())).unwrap_or(1.0);
    if direction.abs() != 1.0 {
        return Err((".direction", format!("it must be 1 or -1, not {direction}")));
    }
    let zero = servo.zero.or(entry.map(|entry| entry.zero())).unwrap_or(0.5 * TURN);
    let homing_offset = entry.map(|entry| entry.homing_offset);
    let mut joint = WiredJoint { name: name.to_owned(), id, model, direction, zero, min: 0.0, max: 0.0, homing_offset };
    let (low, high) = entry.map_or((0.0, TURN - 1.0), |entry| (entry.range_min, entry.range_max));
    let ends = [joint.angle(low), joint.angle(high)];
    joint.min = servo.min.unwrap_or(ends[0].min(ends[1]));
    joint.max = servo.max.unwrap_or(ends[0].max(ends[1]));
    if joint.min < joint.max { Ok(joint) } else { Err((".min", format!("its range is {} to {} rad, which is empty", joint.min, joint.max))) }
}
