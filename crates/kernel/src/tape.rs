// SPDX-License-Identifier: Apache-2.0
//! External inputs of a source while it fires or carries out a script: groups and rows of other sources, readings of devices, the state
//! of a process. Together with the firings and scripts themselves, these determine everything that its blocks compute.
//!
//! A source that is recorded or played back has a [`Tape`], which the kernel queries instead of the outside world.
use device::DeviceError;

/// Subject of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Occasion {
    /// A firing.
    Firing,
    /// The script with this number, between two firings.
    Script(u64),
    /// A restart of the source after a fault had stopped it.
    Restart,
}

/// Records the answer to each external query, in order, or plays back the recorded answers. Called only by its source's kernel; real-time
/// safe.
pub trait Tape: Send + Sync {
    /// Begins the segment of one firing, script or restart.
    fn begin(&self);

    /// Returns true if the tape records, so that `end` must be called.
    fn records(&self) -> bool;

    /// Ends the segment. `digest`: digest of all values stored by the source's blocks; `stopped`: a fault stopped the source.
    fn end(&self, occasion: Occasion, number: u64, time_ns: i64, digest: u64, stopped: bool);

    /// Returns an external number: records `live`, or plays back the recorded one.
    fn number(&self, live: u64) -> u64;

    /// Returns the result of writing a device; `live` performs the write.
    ///
    /// # Errors
    /// Fails if the driver fails, or if it failed when this was recorded.
    fn written(&self, live: &mut dyn FnMut() -> Result<(), DeviceError>) -> Result<(), DeviceError>;

    /// Returns the result of reading a device; `live` reads it into the bytes.
    ///
    /// # Errors
    /// Fails if the driver fails, or if it failed when this was recorded.
    fn read(&self, readings: &mut [u8], live: &mut dyn FnMut(&mut [u8]) -> Result<(), DeviceError>) -> Result<(), DeviceError>;

    /// Returns an external boolean.
    fn whether(&self, live: bool) -> bool {
        self.number(u64::from(live)) != 0
    }
}

/// Extends a digest by more bytes, eight at a time, so that it is cheap enough for every firing.
#[inline]
pub fn digest(mut of: u64, bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    for word in words {
        of = mixed(of, u64::from_le_bytes(*word));
    }
    if rest.is_empty() {
        return of;
    }
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    mixed(of, u64::from_le_bytes(last))
}

#[inline]
fn mixed(of: u64, word: u64) -> u64 {
    let product = (of ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    product ^ product >> 32
}
