// SPDX-License-Identifier: Apache-2.0
//! Layout of a device's channels in its readings and commands.
use crate::channel::{Channel, Direction};

/// Channels of a driver, each placed after the previous one of the same direction.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    channels: Vec<Channel>,
    readings_len: usize,
    commands_len: usize,
}

/// Bytes of one channel, in the readings or the commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    pub offset: usize,
    pub len: usize,
}

/// Width of the widest number; a multiple of it is aligned for every type.
const ALIGNED: usize = 8;

impl Layout {
    /// Adds a channel after the others of the same direction, and returns its location.
    ///
    /// # Panics
    /// Panics if there is already a channel with that name, or if the length of its safe value does not match its type; either is a bug
    /// in the driver.
    pub fn add(&mut self, channel: Channel) -> Slot {
        assert!(!self.has(&channel.name), "channel '{}' is declared twice", channel.name);
        let end = match channel.direction {
            Direction::Read => &mut self.readings_len,
            Direction::Write => {
                assert_eq!(channel.safe.len(), channel.len, "the safe value of channel '{}' differs in length from its type", channel.name);
                &mut self.commands_len
            }
        };
        let slot = Slot { offset: end.next_multiple_of(ALIGNED), len: channel.len };
        *end = slot.offset + slot.len;
        self.channels.push(Channel { offset: slot.offset, ..channel });
        slot
    }

    /// Returns true if there is a channel with that name.
    pub fn has(&self, name: &str) -> bool {
        self.channels.iter().any(|channel| channel.name == name)
    }

    /// Returns the channels so far, in the order in which they were added.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Returns the channels, for [`Driver::channels`](crate::Driver::channels).
    pub fn into_channels(self) -> Vec<Channel> {
        self.channels
    }

    /// Returns the number of bytes of the readings.
    pub fn readings_len(&self) -> usize {
        self.readings_len
    }

    /// Returns the number of bytes of the commands.
    pub fn commands_len(&self) -> usize {
        self.commands_len
    }
}

impl Slot {
    /// Returns the bytes of this channel within `all`, the readings or commands.
    #[inline]
    pub fn of(self, all: &[u8]) -> &[u8] {
        &all[self.offset..self.offset + self.len]
    }

    /// Returns the bytes of this channel for writing.
    #[inline]
    pub fn of_mut(self, all: &mut [u8]) -> &mut [u8] {
        &mut all[self.offset..self.offset + self.len]
    }

    /// Returns element `index` of a channel of doubles.
    #[inline]
    pub fn double(self, all: &[u8], index: usize) -> f64 {
        let mut eight = [0; 8];
        eight.copy_from_slice(&self.of(all)[8 * index..8 * index + 8]);
        f64::from_ne_bytes(eight)
    }

    /// Stores element `index` of a channel of doubles.
    #[inline]
    pub fn set_double(self, all: &mut [u8], index: usize, value: f64) {
        self.of_mut(all)[8 * index..8 * index + 8].copy_from_slice(&value.to_ne_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::Type;

    #[test]
    fn channels_lie_behind_one_another_each_way() {
        let mut layout = Layout::default();
        let button = layout.add(Channel::read("button", Type::BOOL));
        let lamp = layout.add(Channel::write("lamp", Type::BOOL).safe(vec![1]));
        let force = layout.add(Channel::read("force", Type::doubles(3)).unit("N"));
        assert_eq!((button.offset, lamp.offset, force), (0, 0, Slot { offset: 8, len: 24 }));
        assert_eq!((layout.readings_len(), layout.commands_len()), (32, 1));
        assert_eq!(layout.channels()[2].type_text, "double[3]");
        let mut readings = vec![0; layout.readings_len()];
        force.set_double(&mut readings, 2, 4.5);
        assert_eq!((force.double(&readings, 2), force.of(&readings)[..16].to_vec()), (4.5, vec![0; 16]));
    }

    #[test]
    #[should_panic(expected = "channel 'x' is declared twice")]
    fn a_name_is_given_once() {
        let mut layout = Layout::default();
        layout.add(Channel::read("x", Type::DOUBLE));
        layout.add(Channel::write("x", Type::DOUBLE));
    }
}
