// SPDX-License-Identifier: Apache-2.0
//! Calls for logical devices.
use crate::effect::Effect;
use crate::waits::{lasting, until};
use model::refusal::SourceLocation;
use model::value::Value;
use serde_json::json;
use supervisor::{DeviceRequest, DeviceState};

crate::calls! {
    /// Calls for logical devices.
    pub(super) const DEVICES about "logical devices" = [
        /// Creates a logical device with its own verb instance.
        Configure device(must name: String, whole request: DeviceRequest) -> (): commands("name"), goes_with("delete_device", "name")
            => |system| system.device(&name, request);
        /// Starts a device's own verb. Returns its instance, or 0 if there is none. The device is enabled when the verb is ready.
        Operate enable(must name: String) -> u64: commands("name"), told, journalled, moves, effect(Effect::EnablesDevice)
            => |system| system.enable(&name);
        /// Waits until a device is enabled. Returns true if the device is enabled.
        Observe wait_enabled(
            must name: String,
            /// Timeout relative to the call, on the system's clock.
            may timeout_ns: Option<i64>,
            /// Absolute deadline, as an alternative to the timeout.
            may until_ns: Option<i64>,
        ) -> bool: lasts
            => |system, slice| {
                let until_ns = until(system, timeout_ns, until_ns)?;
                let waited = system.wait_enabled(&name, until_ns, slice)?;
                Ok(lasting(waited, false, "wait_enabled", || json!({ "name": name, "until_ns": until_ns })))
            };
        /// Ends the verbs that use a device, then the device's own verb, and waits until they have ended.
        Operate disable(must name: String) -> (): commands("name"), told, outcome_journalled, lasts, stops, free
            => |system, slice| Ok(lasting(system.disable(&name, slice)?, (), "disable", || json!({ "name": name })));
        /// Replaces a device's own verb with another one, within one firing if the device is enabled.
        Configure exchange_verb(must device: String, must verb: String, may place: Option<SourceLocation>) -> ():
            commands("device"), told, moves, replaces(&["device"]), goes_with("delete_device", "device")
            => |system| system.exchange_verb(&device, &verb, place);
        /// Deletes a device.
        Configure delete_device(must name: String) -> (): commands("name"), effect(Effect::DeletesDevice)
            => |system| system.delete_device(&name);
        /// Returns the state of a device: "disabled", "enabling", "standstill", "moving", "stopping" or "fault".
        Observe device_state(must name: String) -> DeviceState
            => |system| system.device_state(&name).map(DeviceState::named);
        /// Returns the value of a device parameter.
        Observe device_parameter(must name: String, must parameter: String) -> Value
            => |system| system.device_parameter(&name, &parameter);
        /// Sets a device parameter.
        Operate set_device_parameter(must name: String, must parameter: String, must value: Value) -> ():
            commands("name"), told, journalled, moves, replaces(&["name", "parameter"]), goes_with("delete_device", "name")
            => |system| system.set_device_parameter(&name, &parameter, value);
    ];
}
