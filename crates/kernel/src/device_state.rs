// SPDX-License-Identifier: Apache-2.0
//! Requests of the channels of a device, and the state of a device: the kernel of its source sets this, others read it.
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

/// Request of a read channel, made by its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Ask {
    /// The emergency stop: outputs are safe from the write of the firing that read it on.
    Stop,
    /// The kernel does nothing: the supervisor is told of each change.
    Tell,
}

/// State of a device. Of a remote one: as it was told last.
pub struct DeviceStanding {
    /// True after it failed: it is no longer read or written.
    pub lost: AtomicBool,
    /// True if it has been read since it was opened. Of a remote one nothing is told.
    pub read: AtomicBool,
    /// Requests of each channel: the reading that asks for something, and whether it does.
    pub asking: Vec<Asking>,
    /// Number of times that the slew limit of each channel acted.
    pub limited: Vec<AtomicU64>,
    /// Calls of `Device::forget`.
    pub forgotten: AtomicU64,
}

impl DeviceStanding {
    pub(crate) fn new(channels: usize) -> DeviceStanding {
        let (asking, limited) = ((0..channels).map(|_| Asking::default()).collect(), (0..channels).map(|_| AtomicU64::new(0)).collect());
        DeviceStanding { lost: AtomicBool::new(false), read: AtomicBool::new(false), asking, limited, forgotten: AtomicU64::new(0) }
    }

    /// Marks it as open again, and not read yet.
    pub fn found(&self) {
        for asking in &self.asking {
            let what = asking.what.load(Ordering::Acquire);
            asking.once.store(false, Ordering::Release);
            // As of `Device::ask`: what would stop is not there until it is read, what tells is not granted until then.
            asking.now.store(what != OFF && what & STOP == 0, Ordering::Release);
        }
        self.read.store(false, Ordering::Release);
        self.lost.store(false, Ordering::Release);
    }
}

/// A channel whose readings are looked at. Flags only, each by itself: the kernel sets, the supervisor reads.
#[derive(Default)]
pub struct Asking {
    /// `OFF`, or what it asks for and whether it does so at 0 (`AT_ZERO`).
    pub(crate) what: AtomicU8,
    /// True while it asks.
    pub now: AtomicBool,
    /// True if it has asked since the last `forget`.
    pub once: AtomicBool,
}

impl Asking {
    /// Returns its request, and whether it makes it at 0; none if nobody looks at it.
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
    /// `Device::ask`.
    Ask { channel: u32, what: Ask, at_zero: bool },
    /// `Device::forget`.
    Forget { channel: u32 },
}
