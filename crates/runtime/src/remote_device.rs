// SPDX-License-Identifier: Apache-2.0
//! A remote device: its processor is asked by [`DeviceCall`] and tells by [`DeviceState`].
use device::{Channel, DeviceError, Driver};
use kernel::{Device, DeviceCall};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// State of a device, as its processor tells it.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct DeviceState {
    /// True if it failed.
    pub lost: bool,
    /// State of each channel: it asks; it asked since the last `forget`; how often its slew limit acted.
    pub channels: Vec<(bool, bool, u64)>,
    /// Calls of `forget` that it has seen.
    pub forgotten: u64,
}

impl DeviceState {
    /// Returns the state of `device`.
    pub fn of(device: &Device) -> DeviceState {
        let channels = (0..device.channels().len()).map(|channel| (device.asks(channel), device.asked(channel), device.slew_limited(channel)));
        DeviceState { lost: device.is_lost(), channels: channels.collect(), forgotten: device.standing().forgotten.load(Ordering::Acquire) }
    }

    /// Stores this state in `device`, a remote one.
    pub fn report(&self, device: &Device) {
        let standing = device.standing();
        standing.lost.store(self.lost, Ordering::Release);
        // What was asked before the last `forget` is forgotten.
        let is_new = self.forgotten == standing.forgotten.load(Ordering::Acquire);
        for ((asking, limited), (now, once, count)) in standing.asking.iter().zip(&standing.limited).zip(&self.channels) {
            asking.now.store(*now, Ordering::Release);
            limited.store(*count, Ordering::Relaxed);
            if is_new {
                asking.once.store(*once, Ordering::Release);
            }
        }
    }
}

/// Makes a remote device, with these channels. `calls` asks its processor.
///
/// # Errors
/// None: as of [`Device::open`].
pub fn open(name: &str, channels: Vec<Channel>, calls: Box<dyn Fn(DeviceCall) + Send + Sync>) -> Result<Arc<Device>, DeviceError> {
    let device = recorded(name, channels)?;
    device.ask_through(calls);
    Ok(device)
}

/// Makes a device of a record, with these channels: what it reads comes from there.
///
/// # Errors
/// None: as of [`Device::open`].
pub fn recorded(name: &str, channels: Vec<Channel>) -> Result<Arc<Device>, DeviceError> {
    Device::open(name, Box::new(UnreachedDriver(channels)), 0)
}

/// Notes that a remote device has been opened again: nothing is known of it, and it is asked again for what it was asked for before.
pub fn renew(device: &Device) {
    let standing = device.standing();
    standing.lost.store(false, Ordering::Release);
    standing.forgotten.store(0, Ordering::Release);
    for (channel, asking) in standing.asking.iter().enumerate() {
        asking.once.store(false, Ordering::Release);
        if let Some((what, at_zero)) = asking.of() {
            device.call(DeviceCall::Ask { channel: channel as u32, what, at_zero });
        }
    }
}

/// The driver of a device that nothing here reaches: it does nothing.
pub(crate) struct UnreachedDriver(pub(crate) Vec<Channel>);

impl Driver for UnreachedDriver {
    fn channels(&self) -> &[Channel] {
        &self.0
    }

    fn open(&mut self, _now_ns: i64) -> Result<(), DeviceError> {
        Ok(())
    }

    fn read(&mut self, _release_ns: i64, _readings: &mut [u8]) -> Result<(), DeviceError> {
        Ok(())
    }

    fn write(&mut self, _release_ns: i64, _commands: &[u8], _engaged: &[bool]) -> Result<(), DeviceError> {
        Ok(())
    }

    fn safe_state(&mut self) {}

    fn close(&mut self) {}
}
