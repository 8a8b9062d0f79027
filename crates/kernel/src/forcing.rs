// SPDX-License-Identifier: Apache-2.0
//! Forced values of a device's channels: they replace readings before any block sees them, and commands before they are written.
use device::{Channel, Direction};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Maximum size of a channel that can be forced, bytes.
pub const FORCED_LEN_MAX: usize = size_of::<u64>();

/// Forced values of the channels of one device.
///
/// | who | does | may block |
/// |---|---|---|
/// | the supervisor, under its lock | stores a value, then its flag, then `any` | nobody |
/// | the kernel of the device's source | reads `any` in each exchange, and flags and values only if it is set | nobody |
///
/// A value is one word, so that a reader sees the earlier or the later one, never a mixture.
pub(crate) struct Forcing {
    /// True if a channel is forced.
    any: AtomicBool,
    channels: Vec<ForcedChannel>,
}

#[derive(Default)]
struct ForcedChannel {
    is_forced: AtomicBool,
    /// Bytes of the value, in memory order.
    value: AtomicU64,
}

impl Forcing {
    pub fn new(channels: usize) -> Forcing {
        Forcing { any: AtomicBool::new(false), channels: (0..channels).map(|_| ForcedChannel::default()).collect() }
    }

    /// Forces a channel to these bytes; `None` ends the forcing.
    pub fn set(&self, channel: usize, value: Option<u64>) {
        let of = &self.channels[channel];
        if let Some(value) = value {
            of.value.store(value, Ordering::Release);
        }
        of.is_forced.store(value.is_some(), Ordering::Release);
        self.any.store(self.channels.iter().any(|channel| channel.is_forced.load(Ordering::Acquire)), Ordering::Release);
    }

    /// Returns true if a channel is forced.
    pub fn is_any(&self) -> bool {
        self.any.load(Ordering::Acquire)
    }

    /// Returns the bytes that a channel is forced to; `None` if it is not forced.
    pub fn of(&self, channel: usize) -> Option<[u8; FORCED_LEN_MAX]> {
        let of = &self.channels[channel];
        of.is_forced.load(Ordering::Acquire).then(|| of.value.load(Ordering::Acquire).to_ne_bytes())
    }

    /// Replaces the readings of the forced channels.
    pub fn replace(&self, channels: &[Channel], readings: &mut [u8]) {
        for (index, channel) in channels.iter().enumerate().filter(|(_, channel)| channel.direction == Direction::Read) {
            if let Some(forced) = self.of(index) {
                readings[channel.offset..channel.offset + channel.len].copy_from_slice(&forced[..channel.len]);
            }
        }
    }
}

/// Returns the bytes of a value as the word that [`Device::force`](crate::Device::force) takes.
///
/// # Panics
/// Panics if there are more than [`FORCED_LEN_MAX`] bytes.
pub fn forced_word(bytes: &[u8]) -> u64 {
    let mut word = [0; FORCED_LEN_MAX];
    word[..bytes.len()].copy_from_slice(bytes);
    u64::from_ne_bytes(word)
}
