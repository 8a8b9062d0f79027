// SPDX-License-Identifier: Apache-2.0
//! Parts that follow their effort, `x' = u`, exactly: a physical device for tests that needs nothing else.
//!
//! Options: `parts` (names; at least one), `initial` (positions, default 0), `fail_at_ns` (from this long after opening on, every
//! read fails: the device is lost), `nan_at_ns` (from then on positions read as NaN), `slew` (limit of each effort, per second).
//!
//! Channels of each part: `<part>.position` (double, rad, read), `<part>.velocity` (double, rad/s, read), `<part>.bias` (double,
//! N.m, read, always 0) and `<part>.effort` (double, N.m, write, safe value 0). The effort written at one firing moves the part
//! until the next; a part whose effort is not claimed stands still.
use crate::bytes::{get, put};
use crate::part::{Part, Servo, UNLIMITED};
use crate::{DriverError, driver};
use kernel::{Channel, DeviceError, Direction, Driver};
use serde::Deserialize;
use serde_json::{Value, json};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    parts: Vec<String>,
    #[serde(default)]
    initial: Vec<f64>,
    fail_at_ns: Option<i64>,
    nan_at_ns: Option<i64>,
    slew: Option<f64>,
}

struct Loopback {
    channels: Vec<Channel>,
    fail_at_ns: i64,
    nan_at_ns: i64,
    opened_ns: i64,
    time_ns: i64,
    position: Vec<f64>,
    velocity: Vec<f64>,
}

/// Makes the device; positions are `initial`.
pub(crate) fn open(options: &Value) -> Result<(Box<dyn Driver>, Value), DriverError> {
    let options: Options = driver::options("loopback", options)?;
    let wrong = |option: &str, problem: String| DriverError::Option { kind: "loopback".into(), option: option.into(), problem };
    let count = options.parts.len();
    if count == 0 {
        return Err(wrong("parts", "name at least one part".into()));
    }
    if let Some(i) = (1..count).find(|i| options.parts[..*i].contains(&options.parts[*i])) {
        return Err(wrong("parts", format!("'{}' is named twice", options.parts[i])));
    }
    if !options.initial.is_empty() && options.initial.len() != count {
        return Err(wrong("initial", format!("{} values for {count} parts", options.initial.len())));
    }
    let position = if options.initial.is_empty() { vec![0.0; count] } else { options.initial.clone() };
    let parts: Vec<Part> = options
        .parts
        .iter()
        .zip(&position)
        .map(|(name, home)| Part {
            name: name.clone(),
            unit: "rad",
            range_min: -UNLIMITED,
            range_max: UNLIMITED,
            effort_max: UNLIMITED,
            speed_max: UNLIMITED,
            home: *home,
            // x' = u is a velocity drive: kp alone, 50 rad/s, makes a first-order servo.
            servo: Servo { kp: 50.0, kd: 0.0 },
        })
        .collect();
    let device = Loopback {
        channels: channels(&options.parts, options.slew),
        fail_at_ns: options.fail_at_ns.unwrap_or(i64::MAX),
        nan_at_ns: options.nan_at_ns.unwrap_or(i64::MAX),
        opened_ns: 0,
        time_ns: 0,
        velocity: vec![0.0; count],
        position,
    };
    Ok((Box::new(device), json!({ "parts": parts })))
}

fn channels(parts: &[String], slew_max: Option<f64>) -> Vec<Channel> {
    let read = |part: &String, name: &str, unit: &str, doc: &str, offset| Channel {
        name: format!("{part}.{name}"),
        direction: Direction::Read,
        type_text: "double".into(),
        unit: unit.into(),
        doc: doc.into(),
        offset,
        len: 8,
        safe: vec![],
        slew_max: None,
    };
    let mut channels = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        channels.push(read(part, "position", "rad", "position", 24 * i));
        channels.push(read(part, "velocity", "rad/s", "velocity", 24 * i + 8));
        channels.push(read(part, "bias", "N.m", "effort that holds it: none", 24 * i + 16));
    }
    for (i, part) in parts.iter().enumerate() {
        channels.push(Channel {
            name: format!("{part}.effort"),
            direction: Direction::Write,
            type_text: "double".into(),
            unit: "N.m".into(),
            doc: "its rate, rad/s for each N.m".into(),
            offset: 8 * i,
            len: 8,
            safe: vec![0; 8],
            slew_max,
        });
    }
    channels
}

impl Driver for Loopback {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        (self.opened_ns, self.time_ns) = (now_ns, now_ns);
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        let since_ns = release_ns - self.opened_ns;
        if since_ns >= self.fail_at_ns {
            return Err(DeviceError { message: format!("the loopback device was told to fail at {} ns", self.fail_at_ns) });
        }
        let span_s = (release_ns - self.time_ns) as f64 * 1e-9;
        self.time_ns = release_ns;
        for (i, (position, velocity)) in self.position.iter_mut().zip(&self.velocity).enumerate() {
            *position += velocity * span_s;
            put(readings, 24 * i, if since_ns >= self.nan_at_ns { f64::NAN } else { *position });
            put(readings, 24 * i + 8, *velocity);
            put(readings, 24 * i + 16, 0.0);
        }
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        for (i, velocity) in self.velocity.iter_mut().enumerate() {
            *velocity = if engaged[i] { get(commands, 8 * i) } else { 0.0 };
        }
        Ok(())
    }

    fn safe_state(&mut self) {
        self.velocity.fill(0.0);
    }

    fn close(&mut self) {
        self.safe_state();
    }
}
