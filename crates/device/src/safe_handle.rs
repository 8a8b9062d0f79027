// SPDX-License-Identifier: Apache-2.0
//! Handles that bring outputs to their safe state without their driver.
use std::os::fd::OwnedFd;

/// Handle with which the guard process (crate `guard`) brings a device's outputs to their safe state once the driver's process has
/// exited.
#[derive(Debug)]
pub struct SafeHandle {
    /// Descriptor to write to: a duplicate of the driver's own, so that it stays open when the driver's process exits.
    pub descriptor: OwnedFd,
    /// Writes to make, in this order: an offset (ignored if the descriptor is not seekable, such as a serial line) and bytes.
    pub writes: Vec<(u64, Vec<u8>)>,
    /// True if the values stay in force until a driver opens the device again, even if the previous driver writes again. A process that
    /// is merely stalled then need not be killed.
    pub latches: bool,
}
