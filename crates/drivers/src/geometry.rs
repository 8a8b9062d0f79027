// SPDX-License-Identifier: Apache-2.0
//! What a machine looks like, for who draws it.
use crate::{DriverError, mujoco};
use serde_json::Value;

/// Bodies, joints, shapes and meshes of the machine that a driver of this kind and these options stands for; nothing where it has
/// none. It loads the model once more and leaves the machine alone, so it may last some tenths of a second: never on the real-time
/// path. Errors: those of [`open`](crate::open), for a model that is not there any more.
pub fn geometry(kind: &str, options: &Value) -> Result<Option<Value>, DriverError> {
    match kind {
        "mujoco" => mujoco::geometry(options).map(Some),
        "plant_process" => match options["driver"]["kind"].as_str() {
            Some(inner) => geometry(inner, &options["driver"]["options"]),
            None => Ok(None),
        },
        _ => Ok(None),
    }
}
