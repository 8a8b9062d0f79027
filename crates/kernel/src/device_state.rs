// SPDX-License-Identifier: Apache-2.0
//! Requests made by the channels of a device, and the state of a device: set by the kernel of its source, read by others.
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

/// Request that a read channel signals by its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Ask {
    /// Emergency stop: makes the outputs safe, starting with the write of the same firing.
    Stop,
    /// Notifies the supervisor of each change; the kernel itself does nothing.
    Tell,
}

/// State of a device; for a remote device, the state last reported.
pub struct DeviceStanding {
    /// True if the device has failed; it is then no longer read or written.
    pub lost: AtomicBool,
    /// True if the device has been read since it was opened. Not reported for remote devices.
    pub read: AtomicBool,
    /// Request of each channel: the value that triggers it, and whether it is currently active.
    pub asking: Vec<Asking>,
    /// Number of times the slew limit of each channel took effect.
    pub limited: Vec<AtomicU64>,
    /// Number of calls of `Device::forget`.
    pub forgotten: AtomicU64,
}

impl DeviceStanding {
    pub(crate) fn new(channels: usize) -> DeviceStanding {
        let (asking, limited) = ((0..channels).map(|_| Asking::default()).collect(), (0..channels).map(|_| AtomicU64::new(0)).collect());
        DeviceStanding { lost: AtomicBool::new(false), read: AtomicBool::new(false), asking, limited, forgotten: AtomicU64::new(0) }
    }

    /// Marks the device as reopened, but not yet read.
    pub fn found(&self) {
        for asking in &self.asking {
            let what = asking.what.load(Ordering::Acquire);
            asking.once.store(false, Ordering::Release);
            // As in `Device::ask`: until the first reading, a stop is not requested and a permission is not granted.
            asking.now.store(what != OFF && what & STOP == 0, Ordering::Release);
        }
        self.read.store(false, Ordering::Release);
        self.lost.store(false, Ordering::Release);
    }
}

/// Request state of a monitored channel. Independent flags, set by the kernel and read by the supervisor.
#[derive(Default)]
pub struct Asking {
    /// `OFF`, or the request, combined with `AT_ZERO` if it is made at 0.
    pub(crate) what: AtomicU8,
    /// True while the channel makes its request.
    pub now: AtomicBool,
    /// True if the channel has made its request since the last `forget`.
    pub once: AtomicBool,
}

impl Asking {
    /// Returns the channel's request, and true if it is made at 0; `None` if the channel is not monitored.
    pub fn of(&self) -> Option<(Ask, bool)> {
        let what = self.what.load(Ordering::Acquire);
        (what != OFF).then_some((if what & STOP != 0 { Ask::Stop } else { Ask::Tell }, what & AT_ZERO != 0))
    }
}

pub(crate) const OFF: u8 = 0;
pub(crate) const STOP: u8 = 1;
pub(crate) const TELL: u8 = 2;
pub(crate) const AT_ZERO: u8 = 4;

/// Request to the processor of a remote device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum DeviceCall {
    /// Calls `Device::ask`.
    Ask { channel: u32, what: Ask, at_zero: bool },
    /// Calls `Device::forget`.
    Forget { channel: u32 },
    /// Calls `Device::force`.
    Force { channel: u32, value: Option<u64> },
}
