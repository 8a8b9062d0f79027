// SPDX-License-Identifier: Apache-2.0
//! Services of loopback parts off the cycle. The source never waits for them: the result of a service takes effect at the next reading.
use device::{DeviceError, Kind, OptionWord, ServiceWord, Services, UNLIMITED};
use serde_json::Value;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

pub(super) const SERVICES: [ServiceWord; 2] = [
    ServiceWord { name: "place", doc: "moves a part to a position at once", arguments: &PLACE, answer: None, moves: false },
    ServiceWord { name: "hold", doc: "answers after a delay, as a homing does", arguments: &HOLD, answer: Some(Kind::Number), moves: false },
];

const PLACE: [OptionWord; 2] = [
    OptionWord::needed("part", Kind::Text, "name of the part"),
    OptionWord::with_default("position", Kind::Number, "0", "its position from the next reading on").unit("rad").within(-UNLIMITED, UNLIMITED),
];

const HOLD: [OptionWord; 1] = [OptionWord::needed("seconds", Kind::Number, "duration of the delay").unit("s").within(0.0, 60.0)];

device::counters! {
    /// Counters of the loopback driver.
    pub(super) enum Count {
        Readings: "readings", "", "number of readings";
    }
}

/// Sentinel for a part whose position was not set: a NaN bit pattern that services never store.
const STAYS: u64 = u64::MAX;

/// Positions set by services since the last reading.
pub(super) struct PlacedParts {
    parts: Vec<String>,
    positions: Vec<AtomicU64>,
}

impl PlacedParts {
    pub fn new(parts: &[String]) -> Arc<PlacedParts> {
        Arc::new(PlacedParts { parts: parts.to_vec(), positions: parts.iter().map(|_| AtomicU64::new(STAYS)).collect() })
    }

    /// Returns the position set for part `index`; `None` if none was set. Real-time safe.
    pub fn take(&self, index: usize) -> Option<f64> {
        let place = &self.positions[index];
        if place.load(Ordering::Relaxed) == STAYS {
            return None;
        }
        Some(place.swap(STAYS, Ordering::AcqRel)).filter(|bits| *bits != STAYS).map(f64::from_bits)
    }
}

impl Services for PlacedParts {
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError> {
        let refuse = |message: String| Err(DeviceError { message });
        if service == "hold" {
            let seconds = arguments["seconds"].as_f64().unwrap_or_default();
            if !(0.0..=60.0).contains(&seconds) {
                return refuse(format!("the duration must be 0 to 60 s, not {seconds} s"));
            }
            std::thread::sleep(Duration::from_secs_f64(seconds));
            return Ok(seconds.into());
        }
        let part = arguments["part"].as_str().unwrap_or_default();
        match self.parts.iter().position(|name| name == part) {
            Some(index) => {
                self.positions[index].store(arguments["position"].as_f64().unwrap_or_default().to_bits(), Ordering::Release);
                Ok(Value::Null)
            }
            None => refuse(format!("there is no part '{part}', only {}", self.parts.join(", "))),
        }
    }
}
