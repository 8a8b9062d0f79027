// SPDX-License-Identifier: Apache-2.0
//! Result of making a driver, and the maker of a driver that was loaded from a file.
use crate::driver::Driver;
use crate::error::DriverError;
use crate::options::GivenOptions;
use crate::services::FoundDevice;
use serde_json::Value;

/// A driver that has been made and not opened, and the description of its machine: `{"parts": [Part, …], …}`; see [`Part`](crate::Part).
pub type OpenedDriver = (Box<dyn Driver>, Value);

/// Maker of drivers of a loaded declaration: unlike a function pointer, it carries its file.
pub trait DriverMaker: Send + Sync {
    /// Makes a driver, like [`Declaration::open`](crate::Declaration::open).
    ///
    /// # Errors
    /// Returns the driver's own error.
    fn open(&self, given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError>;
    /// Searches for devices, like [`Declaration::scan`](crate::Declaration::scan).
    ///
    /// # Errors
    /// Returns the driver's own error.
    fn scan(&self, given: &GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError>;
}
