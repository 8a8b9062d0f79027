// SPDX-License-Identifier: Apache-2.0
//! Version of a system, for a client that connects to it.
use api::Role;
use daemon::Caller;
use daemon::Service;
use daemon::code::target;
use schemars::JsonSchema;
use serde::Serialize;

/// Version of the server, and the caller as the server sees it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Version {
    /// Version of OpenGPAC.
    pub opengpac: &'static str,
    /// Version of the control interface.
    pub interface: u32,
    /// Version of the binary block interface of shared objects.
    pub abi: u32,
    /// Target platform for shared objects on this machine, such as `x86_64-linux`.
    pub target: String,
    /// Name of the real-time system.
    pub system: String,
    /// Identifier of this run of the system. It changes when the system restarts, because the numbering of log entries and other items
    /// then restarts as well.
    pub run: String,
    pub clock: ClockName,
    /// Role of the caller.
    pub role: Role,
}

/// Clock of a system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClockName {
    Monotonic,
    Virtual,
}

/// Returns the answer to `GET /v1/version`.
pub fn version(service: &Service, caller: &Caller) -> Version {
    Version {
        opengpac: env!("CARGO_PKG_VERSION"),
        interface: 1,
        abi: opengpac::abi::ABI,
        target: target(),
        system: service.system.name().to_owned(),
        run: service.system.run().to_owned(),
        clock: if service.system.is_virtual() { ClockName::Virtual } else { ClockName::Monotonic },
        role: caller.role,
    }
}
