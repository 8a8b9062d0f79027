// SPDX-License-Identifier: Apache-2.0
//! Services of a driver off its cycle: commands with typed arguments, and the search for devices.
use crate::error::{DeviceError, DriverError};
use crate::option_word::{Kind, OptionWord};
use crate::options::GivenOptions;
use serde_json::Value;

/// A service of a driver: a command off the cycle, such as reading an object dictionary entry of a drive or homing the drive.
#[derive(Clone, Copy, Debug)]
pub struct ServiceWord {
    pub name: &'static str,
    /// Description, one line.
    pub doc: &'static str,
    /// Arguments: names, kinds, units and defaults, as for options.
    pub arguments: &'static [OptionWord],
    /// Kind of the service's answer; `None` if there is none.
    pub answer: Option<Kind>,
    /// True if the service moves the device and is therefore refused while an emergency stop is latched.
    pub moves: bool,
}

/// Services of an open driver. They are called from threads other than the device's source, during its exchange, so the only state that
/// they may share with the driver is state on which neither side blocks.
pub trait Services: Send + Sync {
    /// Returns the services of this device if they differ from the driver's declaration, otherwise `None`. See
    /// [`DeclaredServices`](crate::DeclaredServices).
    fn words(&self) -> Option<&'static [ServiceWord]> {
        None
    }

    /// Returns true if a service is carried out by [`Services::call_moving`] although it is not declared to move the device, because
    /// whether it does depends on its arguments.
    fn is_told_of_stops(&self, _service: &str) -> bool {
        false
    }

    /// Carries out a declared service, with arguments that were checked against its declaration. It may block.
    ///
    /// # Errors
    /// Returns a human-readable refusal from the device or the driver.
    fn call(&self, service: &str, arguments: &Value) -> Result<Value, DeviceError>;

    /// Carries out a service that moves the device, or must observe stops. `is_stopped` returns true if an emergency stop is latched;
    /// `safe_state` is called after it has become true.
    ///
    /// A stop may occur during the call. A service that passes a request to the next `write` must therefore count the calls of
    /// `safe_state`: it reads their number, then checks `is_stopped`, and `write` discards a request with a different number. The default
    /// implementation checks `is_stopped`, then calls [`Services::call`].
    ///
    /// # Errors
    /// Fails like [`Services::call`], or if an emergency stop is latched.
    fn call_moving(&self, service: &str, arguments: &Value, is_stopped: &dyn Fn() -> bool) -> Result<Value, DeviceError> {
        if is_stopped() {
            return Err(under_a_stop(service));
        }
        self.call(service, arguments)
    }
}

/// Returns the error for a service that would move its device while an emergency stop is latched.
pub fn under_a_stop(service: &str) -> DeviceError {
    DeviceError { message: format!("service '{service}' moves the machine, but an emergency stop is latched: remove its cause and reset it first") }
}

/// Device found by a search.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FoundDevice {
    /// Description, one line.
    pub what: String,
    /// Options that open the device.
    pub options: Value,
}

/// Searches for devices that a driver could open; the options define where to search. Must not move any machine.
pub type Scan = fn(&GivenOptions<'_>) -> Result<Vec<FoundDevice>, DriverError>;
