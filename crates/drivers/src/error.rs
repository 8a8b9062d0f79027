// SPDX-License-Identifier: Apache-2.0
//! Why a driver could not be made.
use std::path::PathBuf;
use thiserror::Error;

/// Why [`open`](crate::open) failed. Each message says what to do next, where that is known.
#[derive(Debug, Error)]
pub enum DriverError {
    /// No driver of that name.
    #[error("no driver '{kind}'; the drivers are {known}")]
    UnknownKind { kind: String, known: String },
    /// An option is missing, unknown or has a wrong value.
    #[error("driver '{kind}': option '{option}': {problem}")]
    Option { kind: String, option: String, problem: String },
    /// A file that an option names cannot be read.
    #[error("driver '{kind}' cannot read '{}': {problem}", path.display())]
    File { kind: String, path: PathBuf, problem: String },
    /// The library that a driver needs is not there.
    #[error(
        "driver 'mujoco' needs the MuJoCo library, {problem}; install it with `pip install mujoco` and give the folder of that package as option 'library', or in OPENGPAC_MUJOCO"
    )]
    LibraryMissing { problem: String },
    /// The library is there, but is not one that this driver knows.
    #[error("driver 'mujoco' needs MuJoCo 4, and '{}' is version {found}; install another with `pip install 'mujoco>=4,<5'`", path.display())]
    LibraryVersion { path: PathBuf, found: String },
    /// A function that this driver calls is not in the library.
    #[error("'{}' has no function '{symbol}'; it is no complete MuJoCo 4 library", path.display())]
    LibrarySymbol { path: PathBuf, symbol: String },
    /// The model does not parse or compile; `problem` is MuJoCo's own message.
    #[error("cannot load the model '{}': {problem}", path.display())]
    Model { path: PathBuf, problem: String },
    /// The model has nothing to command.
    #[error("the model '{}' has no actuated joint: give it an <actuator> with a joint that is a hinge or a slide", path.display())]
    NoActuatedJoint { path: PathBuf },
    /// A process that a driver runs in could not be started, or is gone.
    #[error("driver '{kind}': {problem}")]
    Process { kind: String, problem: String },
}
