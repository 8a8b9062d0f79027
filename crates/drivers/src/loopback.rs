// SPDX-License-Identifier: Apache-2.0
//! Parts that follow their effort, `x' = u`, exactly: a self-contained physical device for tests.
//!
//! Channels of each part: `<part>.position` (double, rad, read), `<part>.velocity` (double, rad/s, read), `<part>.bias` (double, N.m,
//! read, always 0) and `<part>.effort` (double, N.m, write, safe value 0). The effort written at one firing moves the part until the
//! next; a part whose effort is not claimed does not move. With `command` `"position"`, there is `<part>.goal` (double, rad, write)
//! instead of effort and bias: the part reaches it at the next firing.
mod services;

use device::{
    Channel, Command, Counters, Declaration, DeviceError, Driver, DriverError, GivenOptions, Kind, Layout, OpenedDriver, OptionWord, Part, SafeState, Services,
    Servo, Slot, Type, UNLIMITED,
};
use serde::Deserialize;
use serde_json::json;
use services::{Count, PlacedParts, SERVICES};
use std::sync::Arc;

pub(crate) static DRIVER: Declaration = Declaration {
    safe_state: SafeState::OF_SIMULATION,
    services: &SERVICES,
    counters: Count::WORDS,
    ..Declaration::new("loopback", "parts that follow their effort exactly, x' = u, for tests", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 6] = [
    OptionWord::needed("parts", Kind::List, "names of the parts, at least one"),
    OptionWord::with_default("initial", Kind::List, "0 each", "initial positions").unit("rad").within(-UNLIMITED, UNLIMITED),
    OptionWord::with_default("fail_at_ns", Kind::Whole, "never", "time after opening from which every reading fails: the device is lost")
        .unit("ns")
        .within(0.0, f64::INFINITY),
    OptionWord::with_default("nan_at_ns", Kind::Whole, "never", "time after opening from which positions are NaN").unit("ns").within(0.0, f64::INFINITY),
    OptionWord::with_default("slew", Kind::Number, "none", "maximum rate of each effort").unit("N.m/s").above(0.0, 1e9),
    OptionWord::with_default("command", Kind::Text, "effort", "command of the parts: effort or position"),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    parts: Vec<String>,
    #[serde(default)]
    initial: Vec<f64>,
    fail_at_ns: Option<i64>,
    nan_at_ns: Option<i64>,
    slew: Option<f64>,
    #[serde(default)]
    command: Command,
}

struct Loopback {
    channels: Vec<Channel>,
    /// Slots of each part.
    slots: Vec<Slots>,
    fail_at_ns: i64,
    nan_at_ns: i64,
    opened_ns: i64,
    time_ns: i64,
    position: Vec<f64>,
    velocity: Vec<f64>,
    placed: Arc<PlacedParts>,
    counters: Arc<Counters>,
    /// Goal of each part that takes positions, if one is set.
    goal: Vec<Option<f64>>,
}

/// Slots of one part.
struct Slots {
    position: Slot,
    velocity: Slot,
    /// Slot of the bias, for a part that takes efforts.
    bias: Option<Slot>,
    command: Slot,
}

/// Creates the device; the initial positions are `initial`.
fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    let wrong = |option: &str, problem: String| given.wrong(option, problem);
    let count = options.parts.len();
    if count == 0 {
        return Err(wrong("parts", "name at least one part".to_owned()));
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
            // x' = u is a velocity drive: kp alone, 50 rad/s, gives a first-order servo.
            servo: Servo { kp: 50.0, kd: 0.0 },
            command: options.command,
        })
        .collect();
    let (channels, slots) = layout(&options);
    let device = Loopback {
        channels,
        slots,
        fail_at_ns: options.fail_at_ns.unwrap_or(i64::MAX),
        nan_at_ns: options.nan_at_ns.unwrap_or(i64::MAX),
        opened_ns: 0,
        time_ns: 0,
        velocity: vec![0.0; count],
        placed: PlacedParts::new(&options.parts),
        counters: Arc::new(Counters::new(Count::WORDS)),
        goal: vec![None; count],
        position,
    };
    Ok((Box::new(device), json!({ "parts": parts })))
}

fn layout(options: &Options) -> (Vec<Channel>, Vec<Slots>) {
    let mut layout = Layout::default();
    let takes_efforts = options.command == Command::Effort;
    let reads: Vec<(Slot, Slot, Option<Slot>)> = options
        .parts
        .iter()
        .map(|part| {
            let mut read = |name: &str, unit: &str, doc: &str| layout.add(Channel::read(format!("{part}.{name}"), Type::DOUBLE).unit(unit).doc(doc));
            let (position, velocity) = (read("position", "rad", "position"), read("velocity", "rad/s", "velocity"));
            (position, velocity, takes_efforts.then(|| read("bias", "N.m", "effort that holds the part: none")))
        })
        .collect();
    let slots = options.parts.iter().zip(reads).map(|(part, (position, velocity, bias))| {
        let (name, unit, doc) =
            if takes_efforts { ("effort", "N.m", "rate of the part, rad/s for each N.m") } else { ("goal", "rad", "next position of the part") };
        let command = Channel::write(format!("{part}.{name}"), Type::DOUBLE).unit(unit).doc(doc).slew(options.slew);
        let command = if takes_efforts { command } else { command.safe(f64::NAN.to_ne_bytes().to_vec()) };
        Slots { position, velocity, bias, command: layout.add(command) }
    });
    let slots = slots.collect();
    (layout.into_channels(), slots)
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
            return Err(DeviceError { message: format!("the loopback device fails at {} ns, as its options ask", self.fail_at_ns) });
        }
        let span_s = (release_ns - self.time_ns) as f64 * 1e-9;
        self.time_ns = release_ns;
        self.counters.add(Count::Readings, 1);
        for (i, slots) in self.slots.iter().enumerate() {
            let (position, velocity) = (&mut self.position[i], &mut self.velocity[i]);
            if let Some(goal) = self.goal[i] {
                *velocity = if span_s > 0.0 { (goal - *position) / span_s } else { 0.0 };
            }
            *position = self.placed.take(i).unwrap_or(*position + *velocity * span_s);
            slots.position.set_double(readings, 0, if since_ns >= self.nan_at_ns { f64::NAN } else { *position });
            slots.velocity.set_double(readings, 0, *velocity);
            if let Some(bias) = slots.bias {
                bias.set_double(readings, 0, 0.0);
            }
        }
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        for (i, slots) in self.slots.iter().enumerate() {
            let command = if engaged[i] { slots.command.double(commands, 0) } else { 0.0 };
            if slots.bias.is_some() {
                if !command.is_finite() {
                    return Err(DeviceError { message: format!("the effort written to part {i} is not finite; find the block that writes it") });
                }
                self.velocity[i] = command;
            } else {
                (self.velocity[i], self.goal[i]) = (0.0, Some(command).filter(|goal| engaged[i] && goal.is_finite()));
            }
        }
        Ok(())
    }

    fn safe_state(&mut self) {
        self.velocity.fill(0.0);
        self.goal.fill(None);
    }

    fn close(&mut self) {
        self.safe_state();
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        Some(self.placed.clone())
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        Some(self.counters.clone())
    }
}
