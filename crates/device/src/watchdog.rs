// SPDX-License-Identifier: Apache-2.0
//! Watchdog for a device that has none. It acts like the watchdog of a drive: if no new command arrives for its timeout, the device goes
//! to its safe state by itself, and reports this at the driver's next reading.
//!
//! The option `timeout_ns` of every driver that runs in place sets its timeout. A plant in a process of its own has its watchdog in that
//! process. The watchdog starts with the first command that claims a channel, so a device at rest cannot time out.
use crate::accepted::TIMEOUT;
use crate::channel::Channel;
use crate::counters::Counters;
use crate::declaration::Declaration;
use crate::driver::Driver;
use crate::error::{DeviceError, DriverError};
use crate::opening::OpenedDriver;
use crate::options::GivenOptions;
use crate::safe_handle::SafeHandle;
use crate::services::Services;
use std::sync::Arc;

struct Watchdog {
    inner: Box<dyn Driver>,
    timeout_ns: i64,
    /// Time of the latest command that claims a channel; `None` at rest.
    commanded_ns: Option<i64>,
    is_over: bool,
}

/// Creates a driver, with a watchdog if its options request one.
pub(crate) fn watched(given: &GivenOptions<'_>, of: &Declaration) -> Result<OpenedDriver, DriverError> {
    let timeout_ns = given.value()[TIMEOUT.name].as_i64();
    let (inner, about) = of.make(&given.without(TIMEOUT.name))?;
    Ok(match timeout_ns {
        Some(timeout_ns) => (Box::new(Watchdog { inner, timeout_ns, commanded_ns: None, is_over: false }), about),
        None => (inner, about),
    })
}

/// Returns the message of a device that has timed out.
pub fn timeout_message(timeout_ns: i64) -> String {
    format!("it went to its safe state by itself: no command arrived within its timeout of {} ms", timeout_ns as f64 * 1e-6)
}

impl Driver for Watchdog {
    fn channels(&self) -> &[Channel] {
        self.inner.channels()
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.inner.open(now_ns)
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        if let Some(over_ns) = self.commanded_ns.map(|commanded| commanded.saturating_add(self.timeout_ns)).filter(|over_ns| release_ns > *over_ns) {
            (self.commanded_ns, self.is_over) = (None, true);
            // The device moved until then.
            self.inner.read(over_ns, readings)?;
            self.inner.safe_state();
        }
        if self.is_over {
            return Err(DeviceError { message: timeout_message(self.timeout_ns) });
        }
        self.inner.read(release_ns, readings)
    }

    fn taken_ns(&self) -> Option<i64> {
        self.inner.taken_ns()
    }

    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError> {
        self.commanded_ns = engaged.contains(&true).then_some(release_ns);
        self.inner.write(release_ns, commands, engaged)
    }

    fn safe_state(&mut self) {
        self.commanded_ns = None;
        self.inner.safe_state();
    }

    fn close(&mut self) {
        self.inner.close();
    }

    fn safe_handles(&self) -> Vec<SafeHandle> {
        self.inner.safe_handles()
    }

    fn watchdog_ns(&self) -> Option<i64> {
        Some(self.timeout_ns)
    }

    fn services(&self) -> Option<Arc<dyn Services>> {
        self.inner.services()
    }

    fn counters(&self) -> Option<Arc<Counters>> {
        self.inner.counters()
    }
}
