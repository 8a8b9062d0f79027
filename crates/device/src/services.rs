// SPDX-License-Identifier: Apache-2.0
//! Services of a driver beside its cycle: commands with typed arguments, and the search for devices.
use crate::error::{DeviceError, DriverError};
use crate::option_word::{Kind, OptionWord};
use crate::options::GivenOptions;
use serde_json::Value;

/// A service of a driver: a command off the cycle, as reading an object of a drive or homing it.
#[derive(Clone, Copy, Debug)]
pub struct ServiceWord {
    pub name: &'static str,
    /// One line.
    pub doc: &'static str,
    /// Its arguments: names, kinds, units and defaults, as options have them.
    pub arguments: &'static [OptionWord],
    /// Kind of its answer; none: it gives none.
    pub answer: Option<Kind>,
    /// True if it moves the device: it is refused while an emergency stop is latched.
    pub moves: bool,
}

/// Services of an open driver. It is called from threads that are not the device's source, while the source exchanges,
/// so it shares with the driver only what may wait for neither.
pub trait Services: Send + Sync {
    /// Returns the services of this device, if they are others than its driver declares; none: those. See [`DeclaredServices`](crate::Told).
    fn words(&self) -> Option<&'static [ServiceWord]> {
        None
    }

    /// Returns true if a service is carried out by [`Services::call_moving`] although it is not declared to move the device: its arguments decide.
    fn is_told_of_stops(&self, _service: &str) -> bool {
        false
    }

    /// Carries out a service that the driver declares, with arguments that were checked against its declaration. It may wait.
    ///
    /// # Errors
    /// What the device or the driver refuses, for people.
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError>;

    /// Carries out a service that moves the device, or is told of stops. `is_stopped`: whether an emergency stop is latched; `safe_state` is called after it says so.
    ///
    /// A stop may come while it is under way. One that asks something of the next `write` counts the calls of `safe_state`: it takes their number,
    /// looks at `is_stopped`, and `write` begins nothing that was asked under another number. Default: a look, then [`Services::call`].
    ///
    /// # Errors
    /// As [`Services::call`]; an emergency stop is latched.
    fn call_moving(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, DeviceError> {
        if is_stopped() {
            return Err(under_a_stop(service));
        }
        self.call(service, arguments)
    }
}

/// Returns the error of a service that moves its device while an emergency stop is latched.
pub fn under_a_stop(service: &str) -> DeviceError {
    DeviceError { message: format!("service '{service}' moves the machine, and an emergency stop is latched: remove its cause and reset it first") }
}

/// A device that a search found.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FoundDevice {
    /// Description, one line.
    pub what: String,
    /// The options that open it.
    pub options: Value,
}

/// Looks for devices that a driver could open; its options say where. It moves nothing.
pub type Scan = fn(&GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError>;
