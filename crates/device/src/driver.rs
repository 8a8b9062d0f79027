// SPDX-License-Identifier: Apache-2.0
//! Driver interface.
use crate::channel::Channel;
use crate::counters::Counters;
use crate::error::DeviceError;
use crate::safe_handle::SafeHandle;
use crate::services::Services;
use std::sync::Arc;

/// A driver. Its device is brought to its safe state by up to three agents: the driver itself ([`Driver::safe_state`]), the guard, if
/// this process is dead ([`Driver::safe_handles`]), and the device, if no commands arrive ([`Driver::watchdog_ns`]).
///
/// All methods except the constructor are called from the thread of the device's source (under the virtual clock, from the single thread
/// of the system); `read`, `write` and `safe_state` must not allocate, lock or block.
pub trait Driver: Send {
    /// Returns the channels, which are fixed for the lifetime of the driver.
    fn channels(&self) -> &[Channel];
    /// Opens the device; called once before the first firing, off the real-time path. `now_ns` is the time of the clock.
    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError>;
    /// Reads every channel at the firing released at `release_ns` (a simulated plant first advances to that time).
    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError>;
    /// Writes every channel. `engaged[i]` is true if channel i (index among the write channels) is claimed by a running verb; a channel
    /// that is not claimed contains its safe value.
    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError>;
    /// Brings all outputs to their safe state now: after a fault of the source, at an emergency stop, or at the end. At an emergency
    /// stop, it replaces the first `write`; later writes contain safe values, with no channel engaged, until a channel is engaged again.
    fn safe_state(&mut self);
    /// Closes the device; called once at the end, off the real-time path.
    fn close(&mut self);
    /// Returns the handles that bring the outputs to their safe state without this process, valid after `open`. Called once, after
    /// `open`, off the real-time path. By default there are none; the outputs then remain unchanged when the process is lost.
    fn safe_handles(&self) -> Vec<SafeHandle> {
        Vec::new()
    }
    /// Returns the timeout of the device's own watchdog: if no new command arrives for that long, the device goes to its safe state by
    /// itself, and the next [`Driver::read`] reports this. The timeout is known after construction, and a source that is too slow for it
    /// is refused. By default there is no watchdog.
    fn watchdog_ns(&self) -> Option<i64> {
        None
    }
    /// Returns the time at which the device took the readings of the latest [`Driver::read`], on the clock of its `release_ns`; this is
    /// earlier than `release_ns` if the device has not sent anything new. Called after each `read`; real-time safe. The default is the
    /// time of the `read`.
    fn taken_ns(&self) -> Option<i64> {
        None
    }
    /// Returns the object that carries out the declared services. Called once, after construction. By default there is none.
    fn services(&self) -> Option<Arc<dyn Services>> {
        None
    }
    /// Returns the counters as declared. Called once, after construction. By default there are none.
    fn counters(&self) -> Option<Arc<Counters>> {
        None
    }
}
