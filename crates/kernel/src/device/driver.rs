// SPDX-License-Identifier: Apache-2.0
//! The driver of a physical device, and what it says of itself.
use std::os::fd::OwnedFd;

/// Which way a channel goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Direction {
    /// From the machine.
    Read,
    /// To the machine.
    Write,
}

/// A typed, unit-carrying channel of a physical device.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Channel {
    /// `part.channel`, for example `elbow.position`; unique in its device.
    pub name: String,
    /// Which way it goes.
    pub direction: Direction,
    /// C type, for example `double`.
    pub type_text: String,
    /// Unit, or empty.
    pub unit: String,
    /// What it is, one line.
    pub doc: String,
    /// Offset in the readings or in the commands.
    pub offset: usize,
    /// Bytes.
    pub len: usize,
    /// Write: the value that leaves the machine safe (bytes of the type).
    pub safe: Vec<u8>,
    /// Write, `double` only: the fastest change, in units per second; enforced and counted in the write step.
    pub slew_max: Option<f64>,
}

/// Why a device could not be read or written. It becomes the condition `device_lost` of the verbs that use the device.
#[derive(Debug)]
pub struct DeviceError {
    /// For people.
    pub message: String,
}

/// How somebody else brings outputs of a device to their safe state when the process of its driver is gone: the guard process of
/// crate `guard` keeps it.
#[derive(Debug)]
pub struct SafeHandle {
    /// Where to write: a duplicate of the driver's own, so that it stays open when the driver's process ends.
    pub descriptor: OwnedFd,
    /// What to write there, in this order: an offset (no meaning where the descriptor has no positions, as a serial line) and bytes.
    pub writes: Vec<(u64, Vec<u8>)>,
}

/// A driver. All calls but `new`-like construction come from the thread of the device's source (under the virtual clock: from
/// the one thread of the system); `read` and `write` must not allocate, lock or wait.
pub trait Driver: Send {
    /// The channels, fixed for the life of the driver.
    fn channels(&self) -> &[Channel];
    /// Called once before the first firing, off the real-time path. `now_ns`: the clock.
    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError>;
    /// Reads every channel at the firing released at `release_ns` (a simulated plant first advances to that time).
    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError>;
    /// Writes every channel. `engaged[i]`: whether channel i (index among the write channels) is claimed by a running verb;
    /// one that is not carries its safe value.
    fn write(&mut self, release_ns: i64, commands: &[u8], engaged: &[bool]) -> Result<(), DeviceError>;
    /// Brings all outputs to their safe state now: after a fault of the source, an emergency stop, or at the end.
    fn safe_state(&mut self);
    /// Called once at the end, off the real-time path.
    fn close(&mut self);
    /// What brings the outputs to their safe state without this process, from `open` on. Asked once, after `open`, off the
    /// real-time path. Default: nothing; then the outputs stay as they are when the process is lost.
    fn safe_handles(&self) -> Vec<SafeHandle> {
        Vec::new()
    }
}
