// SPDX-License-Identifier: Apache-2.0
//! Interface of a driver.
use crate::channel::Channel;
use crate::counters::Counters;
use crate::error::DeviceError;
use crate::safe_handle::SafeHandle;
use crate::services::Services;
use std::sync::Arc;

/// A driver. Its device is brought to its safe state by up to three: the driver itself ([`Driver::safe_state`]), the guard, where this process
/// is dead ([`Driver::safe_handles`]), and the device, where no commands come ([`Driver::watchdog_ns`]).
///
/// All calls but `new`-like construction come from the thread of the device's source (under the virtual clock: from
/// the one thread of the system); `read`, `write` and `safe_state` must not allocate, lock or wait.
pub trait Driver: Send {
    /// Returns the channels, fixed for the life of the driver.
    fn channels(&self) -> &[Channel];
    /// Opens the device; called once before the first firing, off the real-time path. `now_ns`: the clock.
    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError>;
    /// Reads every channel at the firing released at `release_ns` (a simulated plant first advances to that time).
    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError>;
    /// Writes every channel. `engaged[i]`: whether channel i (index among the write channels) is claimed by a running verb;
    /// one that is not carries its safe value.
    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError>;
    /// Brings all outputs to their safe state now: after a fault of the source, at an emergency stop, or at the end. At an emergency stop it
    /// takes the place of the first `write`; those behind it carry safe values, and nothing is engaged, until a channel is engaged again.
    fn safe_state(&mut self);
    /// Closes the device; called once at the end, off the real-time path.
    fn close(&mut self);
    /// Returns the handles that bring the outputs to their safe state without this process, from `open` on. Asked once, after `open`, off the
    /// real-time path. Default: nothing; then the outputs stay as they are when the process is lost.
    fn safe_handles(&self) -> Vec<SafeHandle> {
        Vec::new()
    }
    /// Returns the watchdog of the device itself: if no new command comes for so long, it goes to its safe state by itself, and its next
    /// [`Driver::read`] says so. It is known from the making on, and a source that is too slow for it is refused. Default: it has none.
    fn watchdog_ns(&self) -> Option<i64> {
        None
    }
    /// Returns when the device took the readings of the latest [`Driver::read`], on the clock of its `release_ns`: earlier than that if the
    /// device has told nothing new. Asked after each `read`; real-time safe. The default is the time of the `read`.
    fn taken_ns(&self) -> Option<i64> {
        None
    }
    /// Returns the object that carries out its declared services. Asked once, after it is made. Default: it has none.
    fn services(&self) -> Option<Arc<dyn Services>> {
        None
    }
    /// Returns its counters, as it declares them. Asked once, after it is made. By default it has none.
    fn counters(&self) -> Option<Arc<Counters>> {
        None
    }
}
