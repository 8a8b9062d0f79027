// SPDX-License-Identifier: Apache-2.0
//! The common time base on the wire: published times are sent on the listening host's clock. A writer converts its own times to that
//! clock and a reader converts them to its own clock, so neither needs the other's clock.
use crate::options::Clocks;
use std::sync::atomic::{AtomicI64, Ordering};

pub(crate) struct Timebase {
    clocks: Clocks,
    /// Origin of the system's times, on this host's CLOCK_MONOTONIC.
    epoch_ns: AtomicI64,
    /// CLOCK_MONOTONIC of the listening host minus this host's.
    offset_ns: AtomicI64,
}

impl Timebase {
    pub(crate) fn new(clocks: Clocks) -> Self {
        Timebase { clocks, epoch_ns: AtomicI64::new(0), offset_ns: AtomicI64::new(0) }
    }

    /// Returns the current CLOCK_MONOTONIC time, ns.
    pub(crate) fn steady_ns(&self) -> i64 {
        (self.clocks.steady)()
    }

    /// Returns the current CLOCK_REALTIME time, ns.
    pub(crate) fn wall_ns(&self) -> i64 {
        (self.clocks.wall)()
    }

    pub(crate) fn set_epoch(&self, epoch_ns: i64) {
        self.epoch_ns.store(epoch_ns, Ordering::Relaxed);
    }

    pub(crate) fn set_offset(&self, offset_ns: i64) {
        self.offset_ns.store(offset_ns, Ordering::Relaxed);
    }

    /// Converts a time of the listening host's CLOCK_MONOTONIC to this host's.
    pub(crate) fn here_ns(&self, listener_ns: i64) -> i64 {
        listener_ns.wrapping_sub(self.offset_ns.load(Ordering::Relaxed))
    }

    /// Converts the system's time on this host to the time base of the wire.
    pub(crate) fn travelling(&self, time_ns: i64) -> i64 {
        time_ns.wrapping_add(self.epoch_ns.load(Ordering::Relaxed)).wrapping_add(self.offset_ns.load(Ordering::Relaxed))
    }

    /// Converts a received time to system time on this host. Clocks agree only to within some uncertainty, so the result is capped at the
    /// current time.
    pub(crate) fn arrived_ns(&self, travelled_ns: i64, now_ns: i64) -> i64 {
        self.here_ns(travelled_ns).min(now_ns).wrapping_sub(self.epoch_ns.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_keeps_its_instant_between_hosts_with_different_clocks_and_epochs() {
        let (writer, reader) = (Timebase::new(Clocks::default()), Timebase::new(Clocks::default()));
        // The listening host's clock reads 1000 when the writer's reads 400 and the reader's 5000.
        writer.set_offset(600);
        writer.set_epoch(100);
        reader.set_offset(-4000);
        reader.set_epoch(4500);
        let travelled_ns = writer.travelling(300);
        assert_eq!(travelled_ns, 1000);
        assert_eq!(reader.arrived_ns(travelled_ns, 6000), 500);
        assert_eq!(reader.arrived_ns(travelled_ns, 4900), 400, "a time is not in the future");
        assert_eq!(writer.arrived_ns(travelled_ns, 6000), 300);
    }
}
