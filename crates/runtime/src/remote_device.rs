// SPDX-License-Identifier: Apache-2.0
//! Remote devices: [`DeviceCall`] is a request sent to the processor, and [`DeviceState`] is its report.
use device::{Channel, DeviceError, Driver};
use kernel::{Device, DeviceCall};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// State of a device, as reported by its processor.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct DeviceState {
    /// True if the device failed.
    pub lost: bool,
    /// State of each channel: true if it makes its request, true if it has made it since the last `forget`, and the number of times its
    /// slew limit took effect.
    pub channels: Vec<(bool, bool, u64)>,
    /// Number of `forget` calls that the processor has handled.
    pub forgotten: u64,
}

impl DeviceState {
    /// Returns the state of `device`.
    pub fn of(device: &Device) -> DeviceState {
        let channels = (0..device.channels().len()).map(|channel| (device.asks(channel), device.asked(channel), device.slew_limited(channel)));
        DeviceState { lost: device.is_lost(), channels: channels.collect(), forgotten: device.standing().forgotten.load(Ordering::Acquire) }
    }

    /// Stores this state in `device`, which must be remote.
    pub fn report(&self, device: &Device) {
        let standing = device.standing();
        standing.lost.store(self.lost, Ordering::Release);
        // Requests reported before the last `forget` are ignored.
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

/// Creates a remote device with these channels. `calls` sends requests to its processor.
///
/// # Errors
/// Same as [`Device::open`]; does not fail in practice.
pub fn open(name: &str, channels: Vec<Channel>, calls: Box<dyn Fn(DeviceCall) + Send + Sync>) -> Result<Arc<Device>, DeviceError> {
    let device = recorded(name, channels)?;
    device.ask_through(calls);
    Ok(device)
}

/// Creates a device for the replay of a record; it has these channels and reads the recorded values.
///
/// # Errors
/// Same as [`Device::open`]; does not fail in practice.
pub fn recorded(name: &str, channels: Vec<Channel>) -> Result<Arc<Device>, DeviceError> {
    Device::open(name, Box::new(UnreachedDriver(channels)), 0)
}

/// Records that a remote device has been reopened, so that its state is unknown and its earlier requests are sent again.
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

/// Driver of a device that cannot be accessed from this process; does nothing.
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
