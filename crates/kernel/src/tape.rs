// SPDX-License-Identifier: Apache-2.0
//! Inputs of a source from outside while it fires or carries out a script: groups and rows of other sources, readings of devices, the
//! state of a process. Together with the firings and scripts themselves, these determine everything that its blocks compute.
//!
//! A source that is recorded or played again has a [`Tape`], which the kernel queries instead of the outside world.
use device::DeviceError;

/// Subject of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Occasion {
    /// A firing.
    Firing,
    /// The script with this number, between two firings.
    Script(u64),
    /// The source was restarted after a fault had stopped it.
    Restart,
}

/// Records each answer from outside in the order of the queries, or plays the recorded ones. Called only by its source's kernel;
/// real-time safe.
pub trait Tape: Send + Sync {
    /// Begins the segment of one firing, script or restart.
    fn begin(&self);

    /// Returns true if it records, so that `end` must be called.
    fn records(&self) -> bool;

    /// Ends the segment. `digest`: digest of all values that the source's blocks have stored; `stopped`: a fault stopped the source.
    fn end(&self, occasion: Occasion, number: u64, time_ns: i64, digest: u64, stopped: bool);

    /// Returns a number from outside: records `live`, or plays the recorded one.
    fn number(&self, live: u64) -> u64;

    /// Returns the result of writing a device; `live` does the writing.
    ///
    /// # Errors
    /// Those of the driver, now or when it was recorded.
    fn written(&self, live: &mut dyn FnMut() -> Result<(), DeviceError>) -> Result<(), DeviceError>;

    /// Returns the result of reading a device; `live` reads it into the bytes.
    ///
    /// # Errors
    /// Those of the driver, now or when it was recorded.
    fn read(&self, readings: &mut [u8], live: &mut dyn FnMut(&mut [u8]) -> Result<(), DeviceError>) -> Result<(), DeviceError>;

    /// Returns a boolean from outside.
    fn whether(&self, live: bool) -> bool {
        self.number(u64::from(live)) != 0
    }
}

/// Continues a digest with more bytes: eight at a time, so that it costs little in every firing.
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
