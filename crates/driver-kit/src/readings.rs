// SPDX-License-Identifier: Apache-2.0
//! Channels of a driver, followed by the age of its readings.
use device::{Channel, DeviceError, Direction, Pace, Slot, Type};

/// Name of the channel that a worker adds.
const AGE: &str = "age";

/// Channels of a driver with their `age`, and its location.
pub(crate) struct AgedChannels {
    pub(crate) channels: Vec<Channel>,
    pub(crate) age: Slot,
    /// Length in bytes of the driver's own readings and commands.
    pub(crate) readings_len: usize,
    pub(crate) commands_len: usize,
    /// Number of channels that are written.
    pub(crate) written: usize,
}

impl AgedChannels {
    pub(crate) fn new(channels: &[Channel]) -> AgedChannels {
        let end = |direction| channels.iter().filter(|channel| channel.direction == direction).map(|channel| channel.offset + channel.len).max().unwrap_or(0);
        let readings_len = end(Direction::Read);
        let age = Slot { offset: readings_len.next_multiple_of(size_of::<f64>()), len: size_of::<f64>() };
        let channel = Channel::read(AGE, Type::DOUBLE).unit("s").doc("age of the readings");
        let channels = channels.iter().cloned().chain([Channel { offset: age.offset, ..channel }]).collect::<Vec<_>>();
        let written = channels.iter().filter(|channel| channel.direction == Direction::Write).count();
        AgedChannels { channels, age, readings_len, commands_len: end(Direction::Write), written }
    }
    /// Stores and returns the age of readings that the device took at `taken_ns`, ns. Real-time safe.
    pub(crate) fn set_age(&self, readings: &mut [u8], release_ns: i64, taken_ns: i64) -> i64 {
        let age_ns = release_ns.saturating_sub(taken_ns).max(0);
        self.age.set_double(readings, 0, age_ns as f64 * 1e-9);
        age_ns
    }
}

/// Fails if the device has not sent anything new for longer than the maximum age of its readings.
pub(crate) fn check_age(pace: &Pace, age_ns: i64) -> Result<(), DeviceError> {
    let Some(most_ns) = pace.taken_max_ns.filter(|most_ns| age_ns > *most_ns) else { return Ok(()) };
    let (age, most) = (age_ns as f64 * 1e-6, most_ns as f64 * 1e-6);
    Err(DeviceError { message: format!("its newest readings are {age:.1} ms old, more than {most} ms: it answers, but delivers nothing new") })
}
