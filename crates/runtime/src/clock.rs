// SPDX-License-Identifier: Apache-2.0
//! Clock of a real-time system: monotonic or virtual.

/// Clock of a host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockKind {
    /// CLOCK_MONOTONIC; every source is a thread.
    Monotonic,
    /// Virtual time, which advances only by `Host::fire_next`. The whole system runs in the caller's thread, ordered by time, priority,
    /// RTP, source, request number. `seed` determines preemptions.
    Virtual { seed: u64 },
}

/// Time budget of a firing under the virtual clock. Time for which its thread waits for a core does not count.
pub(crate) const BUDGET_VIRTUAL_NS: i64 = 1_000_000_000;
