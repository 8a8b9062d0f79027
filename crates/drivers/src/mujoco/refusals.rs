// SPDX-License-Identifier: Apache-2.0
//! Error messages for a simulated arm that cannot be opened.
use device::DriverError;
use std::path::Path;

/// Returns the error for a missing library.
pub(super) fn no_library(problem: String) -> DriverError {
    DriverError::Failed(format!(
        "driver 'mujoco' needs the MuJoCo library, {problem}; install it with `pip install mujoco` and give the folder of that package as option 'library', or in OPENGPAC_MUJOCO"
    ))
}

/// Returns the error for a library that this driver does not support.
pub(super) fn other_version(path: &Path, found: &str) -> DriverError {
    DriverError::Failed(format!(
        "driver 'mujoco' needs MuJoCo 4, but '{}' is version {found}; install another with `pip install 'mujoco>=4,<5'`",
        path.display()
    ))
}

/// Returns the error for a missing function in the library.
pub(super) fn no_symbol(path: &Path, symbol: &str) -> DriverError {
    DriverError::Failed(format!("'{}' has no function '{symbol}', so it is not a complete MuJoCo 4 library", path.display()))
}

/// Returns the error for a model that does not parse or compile; `problem` is MuJoCo's own message.
pub(super) fn model(path: &Path, problem: &str) -> DriverError {
    DriverError::Failed(format!("cannot load the model '{}': {problem}", path.display()))
}

/// Returns the error for a model without an actuated joint.
pub(super) fn no_actuated_joint(path: &Path) -> DriverError {
    DriverError::Failed(format!("the model '{}' has no actuated joint: give it an <actuator> with a hinge or slide joint", path.display()))
}
