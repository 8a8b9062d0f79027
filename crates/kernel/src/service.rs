// SPDX-License-Identifier: Apache-2.0
//! Driver and outputs of a device, which the kernel of its source touches in every firing, and which the layers above exchange between two of them.
use crate::tape::Tape;
use device::{DeviceError, Driver};
use interconnect::{Receiver, Sender};
use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, Ordering};

/// Part of a device that the kernel of its source alone touches.
pub struct Service {
    /// Reads and writes its channels.
    pub driver: Box<dyn Driver>,
    /// Outputs for the driver: commands with safe values and slew limits applied; it also remembers what was written last.
    pub out: Vec<u8>,
    /// True for each write channel that was claimed at the last write.
    pub(crate) engaged: Vec<bool>,
    /// Release of the last write, ns.
    pub written_ns: Option<i64>,
    /// The emergency stop was in force at the last write.
    pub(crate) was_stopped: bool,
    /// Lead of the driver's clock over the source's: the driver has the clock of the host which opened it.
    pub ahead_ns: i64,
    /// Where what it read last goes, for an heir.
    pub shows: Option<Box<dyn Sender>>,
    /// View of the other device whose driver an heir will take over.
    pub looks: Option<Box<dyn View>>,
    /// True if it was taken over, and has not been written since.
    pub is_new: bool,
    /// Its driver is closed.
    pub is_closed: bool,
}

/// The device that an heir is to take over, as the heir sees it.
pub trait View: Send {
    /// Reads what that device read last.
    ///
    /// # Errors
    /// It is lost where it runs.
    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError>;

    /// Gives driver and last outputs of that device to its heir. `ahead_ns`: how much the clock of the host before was ahead of the heir's.
    ///
    /// # Safety
    /// The host of that device has ended.
    unsafe fn give(&self, heir: &mut Service, ahead_ns: i64);
}

impl Service {
    /// Sends the outputs to the driver. The first time that an emergency stop is in force, the device is brought to its safe state instead.
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

    /// Closes it, once: safe state, then the end of the driver.
    pub(crate) fn close(&mut self) {
        if !std::mem::replace(&mut self.is_closed, true) {
            self.driver.safe_state();
            self.driver.close();
        }
    }
}

/// Where others can see what a device read last, and how long nobody wrote it while it was handed over.
pub struct LatestReading {
    /// Last readings, for one heir.
    pub view: Mutex<Option<Box<dyn Receiver>>>,
    gap_ns: AtomicI64,
}

/// Mark: no gap is known.
const NO_GAP: i64 = -1;

impl Default for LatestReading {
    fn default() -> LatestReading {
        LatestReading { view: Mutex::default(), gap_ns: AtomicI64::new(NO_GAP) }
    }
}

impl LatestReading {
    /// Notes a write; the first one after a device was taken over ends the gap.
    pub(crate) fn written(&self, gap_ns: i64) {
        self.gap_ns.store(gap_ns, Ordering::Release);
    }

    /// Returns the gap of a takeover: from the release of the last write before to that of the first write after, ns. None as long as there was none.
    pub fn gap_ns(&self) -> Option<i64> {
        Some(self.gap_ns.load(Ordering::Acquire)).filter(|gap| *gap != NO_GAP)
    }
}
