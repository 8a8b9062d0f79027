// SPDX-License-Identifier: Apache-2.0
//! A driver with its buffers, served as by a source. Each buffer is followed by guard bytes.
use super::measures::Sanitizer;
use device::{Channel, Direction, Driver, OpenedDriver, Slot};
use serde_json::Value;
use std::time::Instant;

/// Time between two firings.
pub(crate) const PERIOD_NS: i64 = 1_000_000;
const GUARD: usize = 64;
const GUARD_BYTE: u8 = 0xA5;

/// A part of the machine, with the channels that command it.
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) position: Slot,
    pub(crate) velocity: Slot,
    /// Reading that holds the part if it is sent back as the command: its bias for an effort, its position for a goal.
    pub(crate) holds_by: Slot,
    pub(crate) command: Slot,
    pub(crate) command_index: usize,
    pub(crate) is_effort: bool,
    pub(crate) effort_max: f64,
    pub(crate) speed_max: f64,
}

pub(crate) struct Rig {
    pub(crate) driver: Box<dyn Driver>,
    pub(crate) about: Value,
    pub(crate) readings: Vec<u8>,
    pub(crate) commands: Vec<u8>,
    pub(crate) engaged: Vec<bool>,
    pub(crate) release_ns: i64,
    readings_len: usize,
    commands_len: usize,
    begun: Instant,
    begun_ns: i64,
    sanitizer: Option<Sanitizer>,
    /// True if the machine moves at its own pace, so that exchanges are timed by the wall clock.
    has_own_pace: bool,
}

/// Returns the length in bytes of the readings or the commands.
pub(crate) fn len(channels: &[Channel], direction: Direction) -> usize {
    channels.iter().filter(|channel| channel.direction == direction).map(|channel| channel.offset + channel.len).max().unwrap_or(0)
}

fn watched<T>(by: Option<Sanitizer>, call: impl FnOnce() -> T) -> T {
    match by {
        Some(sanitizer) => sanitizer.watch(call),
        None => call(),
    }
}

impl Rig {
    pub(crate) fn new((driver, about): OpenedDriver) -> Rig {
        let (readings_len, commands_len) = (len(driver.channels(), Direction::Read), len(driver.channels(), Direction::Write));
        let written = driver.channels().iter().filter(|channel| channel.direction == Direction::Write).count();
        let mut rig = Rig {
            driver,
            about,
            readings: vec![GUARD_BYTE; readings_len + GUARD],
            commands: vec![GUARD_BYTE; commands_len + GUARD],
            engaged: vec![false; written],
            release_ns: 1_000_000_000,
            readings_len,
            commands_len,
            begun: Instant::now(),
            begun_ns: 1_000_000_000,
            sanitizer: None,
            has_own_pace: false,
        };
        rig.readings[..readings_len].fill(0);
        rig.let_go();
        rig
    }

    /// Marks the machine as moving at its own pace.
    pub(crate) fn at_own_pace(self) -> Rig {
        Rig { has_own_pace: true, ..self }
    }

    /// Makes the real-time sanitizer watch the driver's exchanges.
    pub(crate) fn under(self, sanitizer: Sanitizer) -> Rig {
        Rig { sanitizer: Some(sanitizer), ..self }
    }

    /// Advances to the next release.
    pub(crate) fn step(&mut self) {
        if self.has_own_pace { self.on_the_wall() } else { self.release_ns += PERIOD_NS }
    }

    pub(crate) fn open(&mut self) -> Result<(), String> {
        (self.begun, self.begun_ns) = (Instant::now(), self.release_ns);
        self.driver.open(self.release_ns).map_err(|why| format!("it cannot be opened: {}", why.message))
    }

    /// Disengages all channels.
    pub(crate) fn let_go(&mut self) {
        self.engaged.fill(false);
        for channel in self.driver.channels().iter().filter(|channel| channel.direction == Direction::Write) {
            if let Some(place) = self.commands.get_mut(channel.offset..channel.offset + channel.safe.len().min(channel.len)) {
                place.copy_from_slice(&channel.safe[..place.len()]);
            }
        }
    }

    pub(crate) fn read(&mut self) -> Result<(), String> {
        let (driver, readings) = (&mut self.driver, &mut self.readings[..self.readings_len]);
        let read = || driver.read(self.release_ns, readings);
        watched(self.sanitizer, read).map_err(|why| why.message)
    }

    pub(crate) fn write(&mut self) -> Result<(), String> {
        let write = || self.driver.write(self.release_ns, &self.commands[..self.commands_len], &self.engaged);
        watched(self.sanitizer, write).map_err(|why| why.message)
    }

    pub(crate) fn safe_state(&mut self) {
        watched(self.sanitizer, || self.driver.safe_state());
    }

    /// Runs one firing: a reading, a command, and the advance to the next release.
    pub(crate) fn cycle(&mut self) -> Result<(), String> {
        self.read().map_err(|why| format!("its reading fails: {why}"))?;
        self.write().map_err(|why| format!("its writing fails: {why}"))?;
        self.step();
        Ok(())
    }

    pub(crate) fn cycles(&mut self, count: usize) -> Result<(), String> {
        (0..count).try_for_each(|_| self.cycle())
    }

    /// Reads, without writing, until this time has elapsed for the machine, ns.
    pub(crate) fn read_for(&mut self, span_ns: i64) -> Result<(), String> {
        let end_ns = self.release_ns + span_ns;
        while self.release_ns < end_ns {
            self.read()?;
            self.step();
        }
        Ok(())
    }

    /// Sets the release time to the wall-clock time that has elapsed since the driver was opened.
    pub(crate) fn on_the_wall(&mut self) {
        self.release_ns = self.begun_ns + i64::try_from(self.begun.elapsed().as_nanos()).unwrap_or(i64::MAX);
    }

    /// Returns true if the guard bytes after the buffers are unchanged.
    pub(crate) fn is_whole(&self) -> bool {
        [&self.readings[self.readings_len..], &self.commands[self.commands_len..]].concat().iter().all(|byte| *byte == GUARD_BYTE)
    }

    /// Returns the first reading of type `double` that is not finite.
    pub(crate) fn not_finite(&self) -> Option<String> {
        let doubles = self.driver.channels().iter().filter(|channel| channel.direction == Direction::Read && channel.type_text.starts_with("double"));
        doubles
            .flat_map(|channel| (0..channel.len / 8).map(move |index| (channel, index)))
            .find(|(channel, index)| !Slot { offset: channel.offset, len: channel.len }.double(&self.readings, *index).is_finite())
            .map(|(channel, _)| channel.name.clone())
    }

    /// Returns the declared parts with their channels; a part without channels is left out.
    pub(crate) fn joints(&self) -> Vec<Joint> {
        self.about["parts"].as_array().into_iter().flatten().filter_map(|part| self.joint(part)).collect()
    }

    fn joint(&self, part: &Value) -> Option<Joint> {
        let name = part["name"].as_str()?;
        let is_effort = part["command"].as_str() != Some("position");
        let find = |channel: &str, direction| {
            let full = format!("{name}.{channel}");
            self.driver.channels().iter().filter(|channel| channel.direction == direction).position(|channel| channel.name == full)
        };
        let slot = |index: usize, direction| {
            let channel = self.driver.channels().iter().filter(|channel| channel.direction == direction).nth(index)?;
            (channel.type_text == "double").then_some(Slot { offset: channel.offset, len: channel.len })
        };
        let read = |channel: &str| slot(find(channel, Direction::Read)?, Direction::Read);
        let command_index = find(if is_effort { "effort" } else { "goal" }, Direction::Write)?;
        Some(Joint {
            name: name.to_owned(),
            position: read("position")?,
            velocity: read("velocity")?,
            holds_by: read(if is_effort { "bias" } else { "position" })?,
            command: slot(command_index, Direction::Write)?,
            command_index,
            is_effort,
            effort_max: part["effort_max"].as_f64().unwrap_or(device::UNLIMITED),
            speed_max: part["speed_max"].as_f64().unwrap_or(device::UNLIMITED),
        })
    }

    /// Engages each part with its measured values, so that it holds its position.
    pub(crate) fn hold(&mut self, joints: &[Joint]) {
        for joint in joints {
            let value = joint.holds_by.double(&self.readings, 0);
            joint.command.set_double(&mut self.commands, 0, value);
            self.engaged[joint.command_index] = true;
        }
    }

    pub(crate) fn positions(&self, joints: &[Joint]) -> Vec<f64> {
        joints.iter().map(|joint| joint.position.double(&self.readings, 0)).collect()
    }
}
