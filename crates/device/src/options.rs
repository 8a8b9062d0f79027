// SPDX-License-Identifier: Apache-2.0
//! The options that a driver is given.
use crate::error::DriverError;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// The options that a driver is given: known ones only, of the declared kinds, none missing.
pub struct GivenOptions<'a> {
    kind: &'a str,
    options: Value,
}

impl<'a> GivenOptions<'a> {
    /// Takes options that have been checked against what the driver `kind` declares.
    pub(crate) fn checked(kind: &'a str, options: Value) -> GivenOptions<'a> {
        GivenOptions { kind, options }
    }

    /// Reads the options as the driver's own type.
    ///
    /// # Errors
    /// [`DriverError::Option`]: something inside one of them is not as that type wants it.
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

    /// Makes an error that names one of them.
    pub fn wrong(&self, option: &str, problem: impl Into<String>) -> DriverError {
        DriverError::Option { kind: self.kind.into(), option: option.into(), problem: problem.into() }
    }

    /// Returns the same without an option.
    pub(crate) fn without(&self, option: &str) -> GivenOptions<'a> {
        let mut options = self.options.clone();
        if let Some(given) = options.as_object_mut() {
            given.remove(option);
        }
        GivenOptions { kind: self.kind, options }
    }
}
