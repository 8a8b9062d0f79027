// SPDX-License-Identifier: Apache-2.0
//! Driver and outputs of a device: used by the kernel of its source in every firing, and replaced by the layers above between two
//! firings.
use crate::tape::Tape;
use device::{DeviceError, Driver};
use interconnect::{Receiver, Sender};
use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, Ordering};

/// Part of a device that only the kernel of its source accesses.
pub struct Service {
    /// Driver that reads and writes the channels.
    pub driver: Box<dyn Driver>,
    /// Outputs for the driver: commands with safe values and slew limits applied. Also the record of the last write.
    pub out: Vec<u8>,
    /// True for each write channel that was claimed at the last write.
    pub(crate) engaged: Vec<bool>,
    /// Unmodified readings of the driver while a channel is forced.
    pub(crate) unforced: Vec<u8>,
    /// True if a channel was forced at the last reading.
    pub(crate) was_forced: bool,
    /// Release time of the last write, ns.
    pub written_ns: Option<i64>,
    /// True if the emergency stop was in force during the last write.
    pub(crate) was_stopped: bool,
    /// Lead of the driver's clock over the source's; the driver uses the clock of the host that opened it.
    pub ahead_ns: i64,
    /// Publisher of the latest readings, for an heir.
    pub shows: Option<Box<dyn Sender>>,
    /// View of the other device whose driver this heir will take over.
    pub looks: Option<Box<dyn View>>,
    /// True if the device has been taken over but not written since.
    pub is_new: bool,
    /// True if the driver is closed.
    pub is_closed: bool,
}

/// The device that an heir will take over, as the heir sees it.
pub trait View: Send {
    /// Reads the latest readings of that device.
    ///
    /// # Errors
    /// Fails if the device is lost on its own host.
    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError>;

    /// Moves the driver and the last outputs of that device to its heir. `ahead_ns`: lead of the previous host's clock over the heir's.
    ///
    /// # Safety
    /// The host of that device must have ended.
    unsafe fn give(&self, heir: &mut Service, ahead_ns: i64);
}

impl Service {
    /// Sends the outputs to the driver. In the first write while an emergency stop is in force, brings the device to its safe state
    /// instead.
    pub(crate) fn send(&mut self, release_ns: i64, is_stopped: bool, tape: Option<&dyn Tape>) -> Result<(), DeviceError> {
        let stops = is_stopped && !self.was_stopped;
        self.was_stopped = is_stopped;
        let mut live = || {
            if stops {
                self.driver.safe_state();
                return Ok(());
            }
            self.driver.write(release_ns + self.ahead_ns, &self.out, &self.engaged)
        };
        match tape {
            None => live(),
            Some(tape) => tape.written(&mut live),
        }
    }

    /// Closes the device unless it is already closed: brings it to its safe state, then closes the driver.
    pub(crate) fn close(&mut self) {
        if !std::mem::replace(&mut self.is_closed, true) {
            self.driver.safe_state();
            self.driver.close();
        }
    }
}

/// Latest readings of a device, as seen from outside, and the gap between writes during a handover.
pub struct LatestReading {
    /// Latest readings, for one heir.
    pub view: Mutex<Option<Box<dyn Receiver>>>,
    gap_ns: AtomicI64,
}

/// Value for an unknown gap.
const NO_GAP: i64 = -1;

impl Default for LatestReading {
    fn default() -> LatestReading {
        LatestReading { view: Mutex::default(), gap_ns: AtomicI64::new(NO_GAP) }
    }
}

impl LatestReading {
    /// Records a write. The first write after the device was taken over ends the gap.
    pub(crate) fn written(&self, gap_ns: i64) {
        self.gap_ns.store(gap_ns, Ordering::Release);
    }

    /// Returns the gap of a takeover, from the release of the last write before it to the first write after it, in ns; `None` if there
    /// was no takeover.
    pub fn gap_ns(&self) -> Option<i64> {
        Some(self.gap_ns.load(Ordering::Acquire)).filter(|gap| *gap != NO_GAP)
    }
}
