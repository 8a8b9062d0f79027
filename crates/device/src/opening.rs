// SPDX-License-Identifier: Apache-2.0
//! Result of making a driver, and the maker of one that came in a file.
use crate::driver::Driver;
use crate::error::DriverError;
use crate::options::GivenOptions;
use crate::services::FoundDevice;
use serde_json::Value;

/// A driver that has been made and not opened, and what it says of its machine: `{"parts": [Part, …], …}`; see [`Part`](crate::Part).
pub type OpenedDriver = (Box<dyn Driver>, Value);

/// Maker of drivers of a declaration that was loaded: a function pointer knows no file, this does.
pub trait DriverMaker: Send + Sync {
    /// Opens as [`Declaration::open`](crate::Declaration::open).
    ///
    /// # Errors
    /// The driver's own.
    fn open(&self, given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError>;
    /// Scans as [`Declaration::scan`](crate::Declaration::scan).
    ///
    /// # Errors
    /// The driver's own.
    fn scan(&self, given: &GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError>;
}
