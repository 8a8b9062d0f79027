// SPDX-License-Identifier: Apache-2.0
//! Result of creating a driver, and the factory of a driver that was loaded from a file.
use crate::driver::Driver;
use crate::error::DriverError;
use crate::options::GivenOptions;
use crate::services::FoundDevice;
use serde_json::Value;

/// A driver that has been created but not opened, and the description of its machine: `{"parts": [Part, …], …}`; see
/// [`Part`](crate::Part).
pub type OpenedDriver = (Box<dyn Driver>, Value);

/// Creates the drivers of a declaration that was loaded from a library. A trait rather than a function pointer, because it needs to hold
/// the loaded library.
pub trait DriverMaker: Send + Sync {
    /// Creates a driver, like [`Declaration::open`](crate::Declaration::open).
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
