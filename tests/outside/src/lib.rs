// SPDX-License-Identifier: Apache-2.0
//! What a crate outside of this repository brings along: a driver, and a kind of file that blocks come from.
mod axis;
mod lists;

/// Makes both known in this process.
///
/// # Errors
/// Another driver has the name of this one.
pub fn register() -> Result<(), device::DriverError> {
    modules::register(&lists::Lists);
    device::register(&axis::DRIVER)
}
