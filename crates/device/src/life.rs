// SPDX-License-Identifier: Apache-2.0
//! Times of a device's opening, loss and coming to rest: a driver declares them, and the conformance kit measures them.
use std::fmt;

/// Times of a device's opening and loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Life {
    /// Time for which [`Driver::open`](crate::Driver::open) waits for a device that is not there yet, ns; 0: it is there, or refused at once.
    pub waits_ns: i64,
    /// Time from the last answer of a device that is gone until its loss is reported, ns, at most.
    pub lost_within_ns: i64,
}

impl Life {
    /// Life of a device that is there when it is opened, and whose next exchange fails when it is gone.
    pub const IN_PLACE: Life = Life { waits_ns: 0, lost_within_ns: 0 };
}

/// Agent that brings outputs to their safe state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SafeBy {
    /// The driver, by [`Driver::safe_state`](crate::Driver::safe_state).
    Driver,
    /// The guard, by [`Driver::safe_handles`](crate::Driver::safe_handles).
    Guard,
    /// The device's own watchdog, which the driver sets.
    Device,
    /// The end of the driver's process: its machine is computed there, or sees that commands have ended.
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

/// The safe state of a device: what it is, what brings it about, and how soon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SafeState {
    /// Description, one line: `torque off`.
    pub doc: &'static str,
    pub by: &'static [SafeBy],
    /// Time from the request until it holds, ns, at most.
    pub within_ns: i64,
}

impl SafeState {
    /// Safe state in which each output carries its safe value when [`Driver::safe_state`](crate::Driver::safe_state) returns.
    pub const BY_DRIVER: SafeState = SafeState { doc: "each output carries its safe value", by: &[SafeBy::Driver], within_ns: 0 };
    /// The safe values, of a machine that is computed in the driver.
    pub const OF_SIMULATION: SafeState = SafeState { by: &[SafeBy::Driver, SafeBy::End], ..SafeState::BY_DRIVER };

    /// Returns whether the machine goes on under its last commands when the driver's process is gone or hangs: neither a guard nor the
    /// machine itself brings it to its safe state. `watchdog`: the device has a watchdog of its own with these options; `guard`: a guard
    /// runs where the driver does.
    #[must_use]
    pub fn is_unguarded(&self, watchdog: bool, guard: bool) -> bool {
        let by = |one| self.by.contains(&one);
        !(watchdog || by(SafeBy::End) || (guard && by(SafeBy::Guard)))
    }
}
