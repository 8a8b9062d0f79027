// SPDX-License-Identifier: Apache-2.0
//! Services and counters of an open driver, which are used outside its exchange. The code that opens a driver takes and keeps them before
//! the driver moves to the thread of its source.
use crate::counters::Counters;
use crate::driver::Driver;
use crate::error::DriverError;
use crate::option_check::check_service;
use crate::registry::find;
use crate::services::Services;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::sync::Arc;

/// Services and counters of one open driver.
#[derive(Clone, Default)]
pub struct Beside {
    kind: String,
    services: Option<Arc<dyn Services>>,
    counters: Option<Arc<Counters>>,
}

/// Reason why a service was not carried out, with a message.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ServiceError {
    /// The driver has no such service.
    Unknown(String),
    /// An argument is missing, unknown or of the wrong kind.
    Arguments(String),
    /// The device or its driver has failed, with this message.
    Failed(String),
}

impl Beside {
    /// Takes the services and counters from a driver of this `kind`.
    pub fn of(kind: &str, driver: &dyn Driver) -> Beside {
        Beside { kind: kind.to_owned(), services: driver.services(), counters: driver.counters() }
    }

    /// Carries out a service, after checking its arguments. It may block, so no lock must be held when calling it. `is_stopped` returns
    /// true if an emergency stop is latched on this host.
    ///
    /// # Errors
    /// Fails if there is no such service, an argument is wrong, the device refuses it, or the service moves the device while an
    /// emergency stop is latched.
    pub fn serve(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, ServiceError> {
        let own = self.services.as_ref().and_then(|services| services.words());
        let words = own.unwrap_or_else(|| find(&self.kind).map(|of| of.services).unwrap_or_default());
        let checked = check_service(&self.kind, words, service, arguments).map_err(|why| match why {
            DriverError::Service { .. } => ServiceError::Unknown(why.to_string()),
            _ => ServiceError::Arguments(why.to_string()),
        })?;
        let Some(services) = &self.services else {
            return Err(ServiceError::Failed(format!("driver '{}' declares service '{service}' but does not carry out any", self.kind)));
        };
        let moves = services.is_told_of_stops(service) || words.iter().any(|word| word.name == service && word.moves);
        let served = if moves { services.call_moving(service, &checked, is_stopped) } else { services.call(service, &checked) };
        served.map_err(|why| ServiceError::Failed(why.message))
    }

    /// Returns the current counts, by name.
    pub fn counted(&self) -> Vec<(String, u64)> {
        let counters = self.counters.iter().flat_map(|counters| counters.all());
        counters.map(|(word, value)| (word.name.to_owned(), value)).collect()
    }
}
