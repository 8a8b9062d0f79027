// SPDX-License-Identifier: Apache-2.0
//! A device that lies elsewhere: whoever runs it is asked by [`DeviceCall`] and tells by [`DeviceState`].
use super::{AT_ZERO, Ask, Channel, Device, DeviceError, Driver, OFF, STOP};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// What whoever runs a device elsewhere is asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum DeviceCall {
    /// [`Device::ask`].
    Ask { channel: u32, what: Ask, at_zero: bool },
    /// [`Device::forget`].
    Forget { channel: u32 },
}

/// How a device stands, as whoever runs it tells it.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct DeviceState {
    /// It failed.
    pub lost: bool,
    /// For each channel: it asks; it asked since the last `forget`; how often its slew limit acted.
    pub channels: Vec<(bool, bool, u64)>,
    /// Calls of `forget` that it has seen.
    pub forgotten: u64,
}

/// A device that lies elsewhere, in the tables that are kept here: its driver does nothing.
pub(super) struct Unreached(pub Vec<Channel>);

impl Driver for Unreached {
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

impl Device {
    /// One that lies elsewhere, with these channels. `calls` asks whoever runs it.
    pub fn elsewhere(name: &str, channels: Vec<Channel>, calls: Box<dyn Fn(DeviceCall) + Send + Sync>) -> Result<Arc<Device>, DeviceError> {
        let device = Device::open(name, Box::new(Unreached(channels)), 0)?;
        let _first = device.calls.set(calls);
        Ok(device)
    }

    /// How it stands.
    pub fn state(&self) -> DeviceState {
        let channels = (0..self.channels.len()).map(|channel| (self.asks(channel), self.asked(channel), self.slew_limited(channel))).collect();
        DeviceState { lost: self.is_lost(), channels, forgotten: self.forgotten.load(Ordering::Acquire) }
    }

    /// How one that lies elsewhere stands, as it was told last.
    pub fn report(&self, state: &DeviceState) {
        self.lost.store(state.lost, Ordering::Release);
        // What was asked before the last `forget` is forgotten.
        let is_new = state.forgotten == self.forgotten.load(Ordering::Acquire);
        for ((asking, limited), (now, once, count)) in self.asking.iter().zip(&self.limited).zip(&state.channels) {
            asking.now.store(*now, Ordering::Release);
            limited.store(*count, Ordering::Relaxed);
            if is_new {
                asking.once.store(*once, Ordering::Release);
            }
        }
    }

    /// One that lies elsewhere has been opened anew: nothing is known of it, and it is asked again for what it was asked for before.
    pub fn renew(&self) {
        self.lost.store(false, Ordering::Release);
        self.forgotten.store(0, Ordering::Release);
        for (channel, asking) in self.asking.iter().enumerate() {
            asking.once.store(false, Ordering::Release);
            let what = asking.what.load(Ordering::Acquire);
            if what != OFF {
                let asked = if what & STOP != 0 { Ask::Stop } else { Ask::Tell };
                self.call(DeviceCall::Ask { channel: channel as u32, what: asked, at_zero: what & AT_ZERO != 0 });
            }
        }
    }

    pub(super) fn call(&self, call: DeviceCall) {
        if let Some(calls) = self.calls.get() {
            calls(call);
        }
    }
}
