// SPDX-License-Identifier: Apache-2.0
//! The service `home`: sends requests to the cycle, and waits for the result.
use crate::commander::{Commander, Scale};
use crate::homing::HomingState;
use crate::objects::Entry;
use device::{Kind, OptionWord, ServiceWord};
use serde_json::Value;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::time::{Duration, Instant};

const OWN: &str = "as set in the drive";

pub const HOME: ServiceWord = ServiceWord {
    name: "home",
    doc: "makes a drive find its home, and waits until it is there; its axis must not be engaged",
    arguments: &[
        OptionWord::needed("axis", Kind::Text, "the name of the axis"),
        OptionWord::with_default(
            "method",
            Kind::Whole,
            OWN,
            "method of CiA 402: 35 is the present position, 17 and 18 the switch at an end, 33 and 34 the next index",
        )
        .within(-128.0, 127.0),
        OptionWord::with_default("speed", Kind::Number, OWN, "speed towards the switch, units of the axis per second").above(0.0, 1e6),
        OptionWord::with_default("speed_zero", Kind::Number, OWN, "speed towards the index, units of the axis per second").above(0.0, 1e6),
        OptionWord::with_default("acceleration", Kind::Number, OWN, "acceleration, units of the axis per second squared").above(0.0, 1e9),
        OptionWord::with_default("position", Kind::Number, OWN, "position of home, units of the axis").within(-1e9, 1e9),
        OptionWord::with_default("timeout_s", Kind::Number, "60", "time limit").unit("s").above(0.0, 3600.0),
    ],
    answer: None,
    moves: true,
};

/// Default time limit for homing.
const TIMEOUT_S: f64 = 60.0;
/// Interval at which the service checks whether homing is complete.
const LOOK: Duration = Duration::from_millis(1);

/// Progress of the homing of an axis. The service starts and ends homing; the cycle reports its progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum HomingProgress {
    Nothing,
    Home,
    /// The service no longer waits.
    Stop,
    GoingOn,
    Attained,
    Failed,
    Engaged,
    NotExchanged,
    /// The device was lost or closed.
    Gone,
    /// The device was brought to its safe state.
    Stopped,
}

impl HomingProgress {
    fn of(code: u8) -> HomingProgress {
        use HomingProgress::*;
        const ALL: [HomingProgress; 10] = [Nothing, Home, Stop, GoingOn, Attained, Failed, Engaged, NotExchanged, Gone, Stopped];
        ALL.get(usize::from(code)).copied().unwrap_or(Nothing)
    }
}

/// Requests of homing services to the axes. A service begins long before it makes its request. If the device enters its safe state in
/// between, the service ends, and the cycle ignores any later request from it.
pub struct Homes {
    asked: Vec<AtomicU8>,
    /// Number of safe states entered before the requesting service began.
    begun: Vec<AtomicU64>,
    /// Number of safe states entered so far.
    rests: AtomicU64,
    scales: Vec<Scale>,
}

/// Start of a service, as the number of safe states entered before it.
#[derive(Clone, Copy, Debug)]
pub struct ServiceStart(u64);

impl Homes {
    pub fn new(scales: Vec<Scale>) -> Homes {
        Homes {
            asked: scales.iter().map(|_| AtomicU8::new(HomingProgress::Nothing as u8)).collect(),
            begun: scales.iter().map(|_| AtomicU64::new(0)).collect(),
            rests: AtomicU64::new(0),
            scales,
        }
    }

    /// Begins homing, before anything is sent to the drive. `is_stopped` returns true if an emergency stop is latched.
    ///
    /// # Errors
    /// Fails with a message if an emergency stop is latched.
    pub fn begin(&self, is_stopped: &dyn Fn() -> bool) -> Result<ServiceStart, String> {
        // The order matters: if a stop is latched after the check, its safe state is counted after this number.
        let rests = self.rests.load(Ordering::Acquire);
        if is_stopped() { Err(device::under_a_stop("home").message) } else { Ok(ServiceStart(rests)) }
    }

    /// Records that the device is brought to its safe state. This ends all homing, and prevents services that have begun from making
    /// requests.
    pub fn rest(&self) {
        self.rests.fetch_add(1, Ordering::AcqRel);
        self.end_with(HomingProgress::Stopped);
    }

    /// Returns true if the request to an axis came from a service that began before the last safe state.
    fn is_overtaken(&self, axis: usize) -> bool {
        self.begun[axis].load(Ordering::Acquire) != self.rests.load(Ordering::Acquire)
    }

    /// Returns the state of the homing request for an axis: the request itself, or its progress. Real-time safe.
    pub fn asked(&self, axis: usize) -> HomingProgress {
        HomingProgress::of(self.asked[axis].load(Ordering::Acquire))
    }

    /// Stores the progress of an axis. Real-time safe.
    pub fn answer(&self, axis: usize, answer: HomingProgress) {
        self.asked[axis].store(answer as u8, Ordering::Release);
    }

    /// Makes an axis follow the request of the service, and reports its progress. Real-time safe.
    pub fn serve(&self, axis: usize, commander: &mut Commander, can_home: bool, is_engaged: bool) {
        match self.asked(axis) {
            HomingProgress::Home if self.is_overtaken(axis) => self.answer(axis, HomingProgress::Stopped),
            HomingProgress::Home if !can_home => self.answer(axis, HomingProgress::NotExchanged),
            HomingProgress::Home if is_engaged => self.answer(axis, HomingProgress::Engaged),
            HomingProgress::Home => {
                commander.home();
                self.answer(axis, HomingProgress::GoingOn);
            }
            HomingProgress::Stop => {
                commander.leave_homing();
                self.answer(axis, HomingProgress::Nothing);
            }
            HomingProgress::GoingOn => match commander.homed() {
                HomingState::Yes => self.answer(axis, HomingProgress::Attained),
                HomingState::Failed => self.answer(axis, HomingProgress::Failed),
                HomingState::No | HomingState::GoingOn => {}
            },
            _ => {}
        }
    }

    /// Ends all homing.
    pub fn end(&self) {
        self.end_with(HomingProgress::Gone);
    }

    fn end_with(&self, answer: HomingProgress) {
        for axis in 0..self.asked.len() {
            if matches!(self.asked(axis), HomingProgress::Home | HomingProgress::GoingOn) {
                self.answer(axis, answer);
            }
        }
    }

    /// Returns the object dictionary entries of a drive that define its homing.
    ///
    /// # Errors
    /// Fails with a message if an argument is out of range.
    pub fn objects(&self, axis: usize, arguments: &Value) -> Result<Vec<(Entry, Vec<u8>)>, String> {
        let Scale { counts, offset, .. } = self.scales[axis];
        let entry = |index, sub| Entry { index, sub };
        let mut objects = Vec::new();
        if !arguments["method"].is_null() {
            let method = arguments["method"].as_i64().and_then(|method| i8::try_from(method).ok()).ok_or("method must be -128 to 127")?;
            objects.push((entry(0x6098, 0), method.to_le_bytes().to_vec()));
        }
        for (name, index, sub) in [("speed", 0x6099, 1), ("speed_zero", 0x6099, 2), ("acceleration", 0x609A, 0)] {
            let Some(value) = arguments[name].as_f64() else { continue };
            let in_counts = value * counts.abs();
            if !(1.0..=f64::from(u32::MAX)).contains(&in_counts) {
                return Err(format!("{name} must be 1 to {} counts, but {value} is {in_counts} counts", u32::MAX));
            }
            objects.push((entry(index, sub), (in_counts as u32).to_le_bytes().to_vec()));
        }
        if let Some(position) = arguments["position"].as_f64() {
            objects.push((entry(0x607C, 0), ((position * counts + offset).round() as i32).to_le_bytes().to_vec()));
        }
        Ok(objects)
    }

    /// Requests homing of an axis, and waits for it.
    ///
    /// # Errors
    /// Fails with a message if homing fails.
    pub fn go(&self, axis: usize, ServiceStart(begun): ServiceStart, arguments: &Value) -> Result<Value, String> {
        let timeout_s = arguments["timeout_s"].as_f64().unwrap_or(TIMEOUT_S);
        if matches!(self.asked(axis), HomingProgress::Home | HomingProgress::GoingOn) {
            return Err("it is already homing".to_owned());
        }
        self.begun[axis].store(begun, Ordering::Release);
        self.answer(axis, HomingProgress::Home);
        let until = Instant::now() + Duration::from_secs_f64(timeout_s);
        loop {
            match self.asked(axis) {
                HomingProgress::Attained => return Ok(Value::Null),
                HomingProgress::Failed => {
                    return Err("homing failed: the drive did not find home, has a fault, or was stopped; check its error and its method".to_owned());
                }
                HomingProgress::Engaged => return Err("it is engaged: disable it, then home it".to_owned()),
                HomingProgress::NotExchanged => return Err("its drive does not exchange its mode, 0x6060 and 0x6061; let the driver write the PDOs".to_owned()),
                HomingProgress::Stopped => return Err("homing was stopped: its device was brought to its safe state".to_owned()),
                HomingProgress::Gone => return Err("homing ended: the device was lost or closed".to_owned()),
                HomingProgress::Nothing | HomingProgress::Stop => return Err("homing was ended".to_owned()),
                HomingProgress::Home | HomingProgress::GoingOn if Instant::now() > until => {
                    self.answer(axis, HomingProgress::Stop);
                    return Err(format!("homing did not finish within {timeout_s} s, so the axis was stopped"));
                }
                HomingProgress::Home | HomingProgress::GoingOn => std::thread::sleep(LOOK),
            }
        }
    }
}
