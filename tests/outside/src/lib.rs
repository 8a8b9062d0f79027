// SPDX-License-Identifier: Apache-2.0
//! Contributions of a crate outside of this repository: a driver, and a kind of file with blocks.
mod axis;
mod lists;

/// Registers both in this process.
///
/// # Errors
/// Fails if another driver has the same name.
pub fn register() -> Result<(), device::DriverError> {
    modules::register(&lists::Lists);
    device::register(&axis::DRIVER)
}
