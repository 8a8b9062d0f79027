// SPDX-License-Identifier: Apache-2.0
//! Watchdog inside a servo: if its torque is on and there has been no request on the bus for the timeout, the servo stops and accepts no
//! goals. A frame with goals is not answered, so the register is read, for one servo in each exchange.
use super::driver::Servos;
use super::registers::{Register, WATCHDOG_UNIT_NS};
use device::DeviceError;

/// Value of the watchdog's register after it has stopped the servo.
const TRIPPED: u32 = 0xff;

impl Servos {
    fn watched(&self) -> Option<(Register, u8)> {
        self.map.watchdog.zip(self.watchdog)
    }

    /// Clears the stop that a servo's watchdog has caused.
    pub(super) fn forget_watchdog(&mut self, joint: usize) -> Result<(), DeviceError> {
        self.watched().map_or(Ok(()), |(register, _)| self.store(joint, register, &[0]))
    }

    /// Sets the watchdog of a servo before its torque is switched on.
    pub(super) fn set_watchdog(&mut self, joint: usize) -> Result<(), DeviceError> {
        self.watched().map_or(Ok(()), |(register, units)| self.store(joint, register, &[units]))
    }

    /// Checks whether the next servo was stopped by its watchdog.
    pub(super) fn look_at_watchdog(&mut self) -> Result<(), DeviceError> {
        let Some((register, units)) = self.watched() else { return Ok(()) };
        self.looked = (self.looked + 1) % self.joints.len();
        let joint = self.looked;
        if !self.joints[joint].has_torque || self.ask(joint, register)?.value != TRIPPED {
            return Ok(());
        }
        let ms = i64::from(units) * WATCHDOG_UNIT_NS / 1_000_000;
        Err(self.wrong(joint, &format!("was stopped by its own watchdog: there was no request on the line for {ms} ms; reset() and enable()")))
    }
}
