// SPDX-License-Identifier: Apache-2.0
//! Heartbeat of a process: it beats as long as the local sources serve, whether or not there is a watcher. It runs on its own thread,
//! which never waits for sockets, disks or locks held by writers. A remote processor has a heartbeat, and so does a program whose
//! processors are threads.
//!
//! The thread has a priority above every kernel if the process has the privilege, so that a process whose kernels fire does not appear
//! frozen when other threads, here or in another program, occupy the cores for half a second.
use crate::service::Terms;
use crate::shared::{ProcessorState, locked};
use kernel::SourceId;
use runtime::Host;
use std::collections::HashMap;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Time between two beats.
pub const BEAT: Duration = Duration::from_millis(20);

/// Time without a firing after which a timer counts as stuck, provided that it also exceeds a number of periods. Allows for a machine
/// that is held up for half a second.
const STUCK_NS: i64 = 1_000_000_000;
const STUCK_PERIODS: i64 = 10;

/// Runs the heart of a processor until the processor ends. If it is watched by neither the guard nor the supervisor, every output is kept
/// safe from the next firing on, and the heart stops.
pub(crate) fn run(shared: &ProcessorState, terms: &Terms) {
    runtime::take_for_heart();
    let mut firings = Firings::default();
    while !shared.ends.load(Ordering::Acquire) {
        let patience = Duration::from_millis(shared.silence_ms.load(Ordering::Acquire));
        if !patience.is_zero() && (terms.unwatched)(patience) {
            shared.stop.store(true, Ordering::Release);
            return;
        }
        let sources = locked(&shared.sources).clone();
        if shared.leads.load(Ordering::Acquire) {
            (terms.beat)(firings.stuck(&shared.host, &sources));
        }
        if (terms.rests)(BEAT) {
            // Its link breaks only after its memory has been discarded.
            shared.link.close();
        }
    }
}

/// Number of firings of each timer, and the time at which a new firing was last seen.
#[derive(Default)]
pub struct Firings(HashMap<SourceId, (u64, i64)>);

impl Firings {
    /// Returns the index of the first of these timers that no longer fires; `None` while all serve. A timer that a fault stopped has been
    /// reported, and counts as serving.
    pub fn stuck(&mut self, host: &Host, sources: &[SourceId]) -> Option<usize> {
        let now_ns = host.now_ns();
        let mut stuck = None;
        for (place, source) in sources.iter().enumerate() {
            let Some(period_ns) = host.period_ns(*source) else { continue };
            let statistics = host.statistics(*source);
            let seen = self.0.entry(*source).or_insert((statistics.firings, now_ns));
            if seen.0 != statistics.firings || statistics.stopped {
                *seen = (statistics.firings, now_ns);
            }
            if now_ns - seen.1 > STUCK_NS.max(STUCK_PERIODS * period_ns) {
                stuck = stuck.or(Some(place));
            }
        }
        stuck
    }
}
