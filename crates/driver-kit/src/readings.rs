// SPDX-License-Identifier: Apache-2.0
//! The channels of a driver, with the age of its readings behind them.
use device::{Channel, Direction, Slot, Type};

/// Name of the channel that a worker adds.
const AGE: &str = "age";

/// The channels of a driver with their `age`, and where that lies.
pub(crate) struct Aged {
    pub(crate) channels: Vec<Channel>,
    pub(crate) age: Slot,
    /// Bytes of what the driver itself reads and writes.
    pub(crate) readings_len: usize,
    pub(crate) commands_len: usize,
    /// How many of the channels are written.
    pub(crate) written: usize,
}

impl Aged {
    pub(crate) fn new(channels: &[Channel]) -> Aged {
        let end = |direction| channels.iter().filter(|channel| channel.direction == direction).map(|channel| channel.offset + channel.len).max().unwrap_or(0);
        let readings_len = end(Direction::Read);
        let age = Slot { offset: readings_len.next_multiple_of(size_of::<f64>()), len: size_of::<f64>() };
        let channel = Channel::read(AGE, Type::DOUBLE).unit("s").doc("how old the readings are");
        let channels = channels.iter().cloned().chain([Channel { offset: age.offset, ..channel }]).collect::<Vec<_>>();
        let written = channels.iter().filter(|channel| channel.direction == Direction::Write).count();
        Aged { channels, age, readings_len, commands_len: end(Direction::Write), written }
    }
}
