// SPDX-License-Identifier: Apache-2.0
//! Result of making a driver, and the maker of one that came in a file.
use crate::driver::Driver;
use crate::error::DriverError;
use crate::options::Given;
use crate::services::Found;
use serde_json::Value;

/// A driver that has been made and not opened, and what it says of its machine: `{"parts": [Part, …], …}`; see [`Part`](crate::Part).
pub type Opened = (Box<dyn Driver>, Value);

/// Maker of drivers of a declaration that was loaded: a function pointer knows no file, this does.
pub trait Loaded: Send + Sync {
    /// Opens as [`Declaration::open`](crate::Declaration::open).
    ///
    /// # Errors
    /// The driver's own.
    fn open(&self, given: &Given<'_>) -> Result<Opened, DriverError>;
    /// Scans as [`Declaration::scan`](crate::Declaration::scan).
    ///
    /// # Errors
    /// The driver's own.
    fn scan(&self, given: &Given<'_>) -> Result<Vec<Found>, DriverError>;
}
