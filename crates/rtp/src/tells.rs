// SPDX-License-Identifier: Apache-2.0
//! What a processor tells: events as they come, and how it stands.
use crate::agent::{Shared, locked};
use crate::protocol::{Beat, News, RowAs, frame};
use interconnect::{Row, RowsReader};
use kernel::wire::EventAs;
use kernel::{DeviceState, Event, SourceId};
use std::collections::HashMap;
use std::sync::atomic::Ordering;

/// Between two beats, ns.
pub(crate) const BEAT_NS: i64 = 20_000_000;

/// Beats from one that tells counters and histograms to the next.
const STATISTICS_EVERY: u64 = 5;

/// A timer that has not fired for so long, and for so many of its periods, does not serve: a machine may be held up for half a second.
const STUCK_NS: i64 = 1_000_000_000;
const STUCK_PERIODS: i64 = 10;

/// Events and rows in one frame: what is more goes with the next.
const EVENTS_MAX: usize = 256;
const ROWS_MAX: usize = 4096;

/// Until the processor ends.
pub(crate) fn run(shared: &Shared, heart: &dyn Fn()) {
    let mut beats = Beats::default();
    let mut next_ns = shared.host.now_ns();
    loop {
        let seen = shared.host.rings();
        let ends = shared.ends.load(Ordering::Acquire);
        while tell_events(shared, &mut beats) {}
        let now_ns = shared.host.now_ns();
        if now_ns >= next_ns || ends {
            if beats.serve(shared, now_ns) && shared.leads.load(Ordering::Acquire) {
                heart();
            }
            let beat = beats.take(shared, now_ns);
            let _heard = shared.link.send(&frame(&News::Beat(beat)));
            next_ns = (now_ns / BEAT_NS + 1) * BEAT_NS;
        }
        if ends {
            return;
        }
        shared.host.park_since(seen, Some(next_ns));
    }
}

/// Sends what kernels told; false where there was nothing.
fn tell_events(shared: &Shared, beats: &mut Beats) -> bool {
    let mut events = Vec::new();
    let mut looks = false;
    while events.len() < EVENTS_MAX
        && let Some(event) = shared.host.poll()
    {
        looks |= matches!(event, Event::Asked { .. } | Event::DeviceLost { .. });
        events.extend(EventAs::of(event));
    }
    if events.is_empty() {
        return false;
    }
    // What histories hold is there before what is said of it.
    let rows = beats.all_rows(shared);
    if !rows.is_empty() {
        let _heard = shared.link.send(&frame(&News::Beat(Beat { now_ns: shared.host.now_ns(), rows, ..Beat::default() })));
    }
    // How the devices stand comes with what is said of them.
    let devices = if looks { states(shared) } else { Vec::new() };
    let _heard = shared.link.send(&frame(&News::Events { events, devices }));
    true
}

fn states(shared: &Shared) -> Vec<(String, DeviceState)> {
    locked(&shared.devices).iter().map(|(name, device)| (name.clone(), device.state())).collect()
}

/// What was told before, so that only what is new is told again.
#[derive(Default)]
struct Beats {
    count: u64,
    devices: HashMap<String, DeviceState>,
    inbounds: HashMap<u64, (Option<i64>, Option<i64>)>,
    /// Rows taken of each ring.
    taken: HashMap<u64, u64>,
    /// Of each timer: its firings, and when there was a new one last.
    firings: HashMap<SourceId, (u64, i64)>,
}

impl Beats {
    /// True while every timer here fires: one that a fault stopped has said so, and counts as serving.
    fn serve(&mut self, shared: &Shared, now_ns: i64) -> bool {
        let sources = locked(&shared.sources).clone();
        let mut serves = true;
        for source in sources {
            let Some(period_ns) = shared.host.period_ns(source) else { continue };
            let statistics = shared.host.statistics(source);
            let seen = self.firings.entry(source).or_insert((statistics.firings, now_ns));
            if seen.0 != statistics.firings || statistics.stopped {
                *seen = (statistics.firings, now_ns);
            }
            serves &= now_ns - seen.1 <= STUCK_NS.max(STUCK_PERIODS * period_ns);
        }
        serves
    }

    fn take(&mut self, shared: &Shared, now_ns: i64) -> Beat {
        self.count += 1;
        let mut beat = Beat { now_ns, ..Beat::default() };
        if self.count % STATISTICS_EVERY == 1 {
            let sources = locked(&shared.sources).clone();
            beat.sources = sources.into_iter().map(|source| (source, shared.host.statistics(source))).collect();
        }
        beat.devices = states(shared).into_iter().filter(|(name, state)| self.devices.insert(name.clone(), state.clone()).as_ref() != Some(state)).collect();
        let inbounds: Vec<_> = locked(&shared.reader).inbounds().map(|(number, inbound)| (number, inbound.brought_ns(), inbound.late_since_ns())).collect();
        self.inbounds.retain(|number, _| inbounds.iter().any(|(known, ..)| known == number));
        beat.inbounds =
            inbounds.into_iter().filter(|(number, brought, late)| self.inbounds.insert(*number, (*brought, *late)) != Some((*brought, *late))).collect();
        beat.rows = self.all_rows(shared);
        beat
    }

    /// The new rows of each ring.
    fn all_rows(&mut self, shared: &Shared) -> Vec<(u64, Vec<RowAs>)> {
        let rings: Vec<_> = locked(&shared.reader).rings().collect();
        self.taken.retain(|number, _| rings.iter().any(|(known, _)| known == number));
        rings.into_iter().filter_map(|(number, ring)| self.rows(number, &ring)).collect()
    }

    fn rows(&mut self, number: u64, ring: &RowsReader) -> Option<(u64, Vec<RowAs>)> {
        let taken = self.taken.entry(number).or_default();
        let mut rows = Vec::new();
        let lost = ring.since(*taken, &mut rows);
        rows.truncate(ROWS_MAX);
        *taken += lost + rows.len() as u64;
        let rows: Vec<RowAs> = rows.into_iter().map(|Row { number, time_ns, bytes, .. }| (number, time_ns, bytes)).collect();
        (!rows.is_empty()).then_some((number, rows))
    }
}
