// SPDX-License-Identifier: Apache-2.0
//! A driver of class `worker` that exchanges on the thread of its source; the age of its readings is determined by the device.
use crate::readings::{AgedChannels, check_age};
use device::{Channel, Counters, DeviceError, Driver, Pace, SafeHandle, Services};
use std::sync::Arc;

pub(crate) struct InPlace {
    inner: Box<dyn Driver>,
    aged: AgedChannels,
    pace: Pace,
}

impl InPlace {
    pub(crate) fn new(inner: Box<dyn Driver>, pace: Pace) -> Self {
        let aged = AgedChannels::new(inner.channels());
        InPlace { inner, aged, pace }
    }
}

impl Driver for InPlace {
    fn channels(&self) -> &[Channel] {
        &self.aged.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.inner.open(now_ns)
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        self.inner.read(release_ns, &mut readings[..self.aged.readings_len])?;
        let age_ns = self.aged.set_age(readings, release_ns, self.inner.taken_ns().unwrap_or(release_ns));
        check_age(&self.pace, age_ns)
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.inner.write(release_ns, commands, engaged)
    }

    fn safe_state(&mut self) {
        self.inner.safe_state();
    }

    fn close(&mut self) {
        self.inner.close();
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        self.inner.safe_handles()
    }

    fn watchdog_ns(&self) -> Option<i64> {
        self.inner.watchdog_ns()
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        self.inner.services()
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        self.inner.counters()
    }
}
