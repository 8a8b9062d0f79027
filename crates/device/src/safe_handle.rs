// SPDX-License-Identifier: Apache-2.0
//! Handles that bring outputs to their safe state without their driver.
use std::os::fd::OwnedFd;

/// Handle by which another process brings outputs of a device to their safe state when the process of its driver is gone: the
/// guard process of crate `guard` keeps it.
#[derive(Debug)]
pub struct SafeHandle {
    /// Where to write: a duplicate of the driver's own, so that it stays open when the driver's process ends.
    pub descriptor: OwnedFd,
    /// Writes to make there, in this order: an offset (no meaning where the descriptor has no positions, as a serial line) and bytes.
    pub writes: Vec<(u64, Vec<u8>)>,
    /// True if the values stay in force until a driver opens the device again, whatever the old one still writes. Then a process that only
    /// stands still need not be ended.
    pub latches: bool,
}
