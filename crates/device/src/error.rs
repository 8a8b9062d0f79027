// SPDX-License-Identifier: Apache-2.0
//! Errors that occur when a driver is created, and when its device is read or written.
use crate::class::Class;
use std::path::PathBuf;
use thiserror::Error;

/// Reason why [`open`](crate::open) failed. Each message suggests the next step if it is known.
#[derive(Debug, Error)]
pub enum DriverError {
    /// There is no driver with that name.
    #[error("there is no driver '{kind}'{meant}; the drivers are {known}")]
    UnknownKind { kind: String, meant: String, known: String },
    /// An option is missing, unknown or has a wrong value.
    #[error("driver '{kind}': option '{option}': {problem}")]
    Option { kind: String, option: String, problem: String },
    /// A file named by an option cannot be read.
    #[error("driver '{kind}' cannot read '{}': {problem}", path.display())]
    File { kind: String, path: PathBuf, problem: String },
    /// This program provides no thread or process for drivers of this class.
    #[error("driver '{kind}' is declared as {class}, which this program does not serve; open it with crate drivers, or declare it inline")]
    Class { kind: String, class: Class },
    /// The driver has no such service.
    #[error("driver '{kind}' has no service '{service}'; {problem}")]
    Service { kind: String, service: String, problem: String },
    /// An argument of a service is missing, unknown or has a wrong value.
    #[error("service '{service}' of driver '{kind}': argument '{argument}': {problem}")]
    Argument { kind: String, service: String, argument: String, problem: String },
    /// The driver cannot search for devices.
    #[error("driver '{kind}' cannot search for devices; see its manual for the options that open one")]
    NoScan { kind: String },
    /// A different driver with that name is registered.
    #[error("there is already a driver '{kind}'; register this one under another name")]
    Taken { kind: String },
    /// The process in which a driver runs could not be started, or has exited.
    #[error("driver '{kind}': {problem}")]
    Process { kind: String, problem: String },
    /// Error message of the driver.
    #[error("{0}")]
    Failed(String),
}

/// Reason why a device could not be read or written. It becomes the condition `device_lost` of the verbs that use the device.
#[derive(Debug)]
pub struct DeviceError {
    /// Human-readable message.
    pub message: String,
}
