// SPDX-License-Identifier: Apache-2.0
//! The heart of what runs in a process: it beats as long as the sources here serve, on a thread of its own that waits for no socket, lock of a
//! writer or disk. Whether anybody hears what is told is nothing to it. A remote processor has one, and a program whose processors are
//! threads.
//!
//! It runs above every kernel where the rights are given, so that a process whose kernels fire does not look frozen when something else, here
//! or in another program, takes the cores from ordinary threads for half a second.
use crate::service::Terms;
use crate::shared::{ProcessorState, locked};
use kernel::SourceId;
use runtime::Host;
use std::collections::HashMap;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Between two beats.
pub const BEAT: Duration = Duration::from_millis(20);

/// A timer that has not fired for so long, and for so many of its periods, does not serve: a machine may be held up for half a second.
const STUCK_NS: i64 = 1_000_000_000;
const STUCK_PERIODS: i64 = 10;

/// Runs the heart of a processor until that ends. If neither the guard nor the supervisor watches it, every output is safe from the next
/// firing on, and the heart stops.
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
            // Its link breaks only when its memory has been put away.
            shared.link.close();
        }
    }
}

/// Firings of each timer, and when there was a new one last.
#[derive(Default)]
pub struct Firings(HashMap<SourceId, (u64, i64)>);

impl Firings {
    /// Returns the index among these of the first timer that no longer fires; none while all serve. One that a fault stopped has said so, and
    /// counts as serving.
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
