// SPDX-License-Identifier: Apache-2.0
//! The one door to the drivers: a name and options give a driver and a description of its parts.
use crate::{DriverError, loopback, mujoco, plant_process, scripted};
use kernel::Driver;
use serde_json::Value;

/// The names that [`open`] knows.
pub const KINDS: &[&str] = &["mujoco", "loopback", "plant_process", "scripted"];

/// Makes the driver `kind` from its options (a JSON object; each driver's page lists its own), not yet opened.
///
/// The second value describes the machine: `{"parts": [Part, …], …}`; see [`Part`](crate::Part). It may allocate, read files
/// and load libraries: never on the real-time path. Errors: an unknown kind, a wrong option, and each driver's own.
pub fn open(kind: &str, options: &Value) -> Result<(Box<dyn Driver>, Value), DriverError> {
    match kind {
        "mujoco" => mujoco::open(options),
        "loopback" => loopback::open(options),
        "plant_process" => plant_process::open(options),
        "scripted" => scripted::open(options),
        _ => Err(DriverError::UnknownKind { kind: kind.into(), known: KINDS.join(", ") }),
    }
}

/// Reads the options of a driver: unknown names and wrong types are errors that name the option.
pub(crate) fn options<T: serde::de::DeserializeOwned>(kind: &str, options: &Value) -> Result<T, DriverError> {
    serde_json::from_value(options.clone()).map_err(|e| {
        let text = e.to_string();
        let option = text.split('`').nth(1).unwrap_or("").to_string();
        DriverError::Option { kind: kind.into(), option, problem: text }
    })
}
