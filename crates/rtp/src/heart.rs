// SPDX-License-Identifier: Apache-2.0
//! The heart of a processor: it beats as long as the sources here serve, on a thread of its own that waits for no socket, lock of a
//! writer or disk. Whether anybody hears what the processor tells is nothing to it.
use crate::agent::{Shared, locked};
use kernel::SourceId;
use std::collections::HashMap;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Between two beats.
const BEAT: Duration = Duration::from_millis(20);

/// A timer that has not fired for so long, and for so many of its periods, does not serve: a machine may be held up for half a second.
const STUCK_NS: i64 = 1_000_000_000;
const STUCK_PERIODS: i64 = 10;

/// Until the processor ends.
pub(crate) fn run(shared: &Shared, beat: &dyn Fn()) {
    let mut firings = Firings::default();
    while !shared.ends.load(Ordering::Acquire) {
        if firings.serve(shared) && shared.leads.load(Ordering::Acquire) {
            beat();
        }
        std::thread::sleep(BEAT);
    }
}

/// Of each timer: its firings, and when there was a new one last.
#[derive(Default)]
struct Firings(HashMap<SourceId, (u64, i64)>);

impl Firings {
    /// True while every timer here fires: one that a fault stopped has said so, and counts as serving.
    fn serve(&mut self, shared: &Shared) -> bool {
        let now_ns = shared.host.now_ns();
        let sources = locked(&shared.sources).clone();
        let mut serves = true;
        for source in sources {
            let Some(period_ns) = shared.host.period_ns(source) else { continue };
            let statistics = shared.host.statistics(source);
            let seen = self.0.entry(source).or_insert((statistics.firings, now_ns));
            if seen.0 != statistics.firings || statistics.stopped {
                *seen = (statistics.firings, now_ns);
            }
            serves &= now_ns - seen.1 <= STUCK_NS.max(STUCK_PERIODS * period_ns);
        }
        serves
    }
}
