// SPDX-License-Identifier: Apache-2.0
//! Timing of a device's opening, loss and safe state: declared by the driver, and measured by the conformance kit.
use std::fmt;

/// Timing of a device's opening and loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Life {
    /// Time for which [`Driver::open`](crate::Driver::open) waits for a device that is not present yet, ns; if 0, it fails immediately
    /// when the device is absent.
    pub waits_ns: i64,
    /// Maximum time from the last response of a lost device until its loss is reported, ns.
    pub lost_within_ns: i64,
}

impl Life {
    /// Timing of a device that is present when it is opened, and whose loss makes the next exchange fail.
    pub const IN_PLACE: Life = Life { waits_ns: 0, lost_within_ns: 0 };
}

/// Agent that brings outputs to their safe state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SafeBy {
    /// The driver, by [`Driver::safe_state`](crate::Driver::safe_state).
    Driver,
    /// The guard, by [`Driver::safe_handles`](crate::Driver::safe_handles).
    Guard,
    /// The device's own watchdog, set by the driver.
    Device,
    /// The exit of the driver's process: the machine is simulated in it, or detects that commands have stopped.
    End,
}

impl fmt::Display for SafeBy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            SafeBy::Driver => "driver",
            SafeBy::Guard => "guard",
            SafeBy::Device => "device",
            SafeBy::End => "end of process",
        })
    }
}

/// Safe state of a device: the state, the agents that establish it, and its delay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SafeState {
    /// Description, one line, such as `torque off`.
    pub doc: &'static str,
    pub by: &'static [SafeBy],
    /// Maximum time from the request until the state is reached, ns.
    pub within_ns: i64,
}

impl SafeState {
    /// Safe state in which each output has its safe value when [`Driver::safe_state`](crate::Driver::safe_state) returns.
    pub const BY_DRIVER: SafeState = SafeState { doc: "each output carries its safe value", by: &[SafeBy::Driver], within_ns: 0 };
    /// Safe state of a machine that is simulated in the driver.
    pub const OF_SIMULATION: SafeState = SafeState { by: &[SafeBy::Driver, SafeBy::End], ..SafeState::BY_DRIVER };

    /// Returns true if the machine continues under its last commands when the driver's process has exited or hangs, because neither a
    /// guard nor the machine itself brings it to its safe state. `watchdog` is true if the device has a watchdog of its own with these
    /// options; `guard` is true if a guard runs alongside the driver.
    #[must_use]
    pub fn is_unguarded(&self, watchdog: bool, guard: bool) -> bool {
        let by = |one| self.by.contains(&one);
        !(watchdog || by(SafeBy::End) || (guard && by(SafeBy::Guard)))
    }
}
