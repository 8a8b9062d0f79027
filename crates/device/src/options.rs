// SPDX-License-Identifier: Apache-2.0
//! Options passed to a driver.
use crate::error::DriverError;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// Options passed to a driver: only declared options, of the declared kinds, with none missing.
pub struct GivenOptions<'a> {
    kind: &'a str,
    options: Value,
}

impl<'a> GivenOptions<'a> {
    /// Wraps options that have been checked against the declaration of the driver `kind`.
    pub(crate) fn checked(kind: &'a str, options: Value) -> GivenOptions<'a> {
        GivenOptions { kind, options }
    }

    /// Deserialises the options into the driver's own type.
    ///
    /// # Errors
    /// Returns [`DriverError::Option`] if a nested value does not fit that type.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, DriverError> {
        serde_json::from_value(self.options.clone()).map_err(|error| {
            let problem = error.to_string();
            let option = crate::nested::path(&self.options, |options| serde_json::from_value::<T>(options.clone()).err().map(|error| error.to_string()));
            DriverError::Option { kind: self.kind.into(), option, problem }
        })
    }

    /// Returns the options as they are.
    pub fn value(&self) -> &Value {
        &self.options
    }

    /// Creates an error that names an option.
    pub fn wrong(&self, option: &str, problem: impl Into<String>) -> DriverError {
        DriverError::Option { kind: self.kind.into(), option: option.into(), problem: problem.into() }
    }

    /// Returns the same options with one of them removed.
    pub(crate) fn without(&self, option: &str) -> GivenOptions<'a> {
        let mut options = self.options.clone();
        if let Some(given) = options.as_object_mut() {
            given.remove(option);
        }
        GivenOptions { kind: self.kind, options }
    }
}
