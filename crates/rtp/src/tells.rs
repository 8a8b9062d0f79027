// SPDX-License-Identifier: Apache-2.0
//! Reports of a processor to its commander: events as they occur, and its state.
use crate::protocol::{Beat, DriverCounters, News, RowAs, frame};
use crate::shared::{ProcessorState, locked};
use interconnect::{Row, RowsReader};
use kernel::{BlockId, BlockTimes, Event};
use runtime::DeviceState;
use runtime::encoding::EventAs;
use std::collections::HashMap;
use std::sync::atomic::Ordering;

/// Time between two beats, ns.
pub(crate) const BEAT_NS: i64 = 20_000_000;

/// Number of beats between two reports of counters and histograms.
const STATISTICS_EVERY: u64 = 5;

/// Maximum number of events and rows in one frame; excess ones are sent in the next frame.
const EVENTS_MAX: usize = 256;
const ROWS_MAX: usize = 4096;

/// Runs until the processor ends. A commander that does not read blocks only this thread.
pub(crate) fn run(shared: &ProcessorState) {
    let mut beats = Beats::default();
    let mut next_ns = shared.host.now_ns();
    loop {
        let seen = shared.host.rings();
        let ends = shared.ends.load(Ordering::Acquire);
        while tell_events(shared, &mut beats) {}
        let now_ns = shared.host.now_ns();
        if now_ns >= next_ns || ends {
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

/// Sends the events of kernels; returns false if there were none.
fn tell_events(shared: &ProcessorState, beats: &mut Beats) -> bool {
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
    // Rows of histories are sent before the events that refer to them.
    let rows = beats.all_rows(shared);
    if !rows.is_empty() {
        let _heard = shared.link.send(&frame(&News::Beat(Beat { now_ns: shared.host.now_ns(), rows, ..Beat::default() })));
    }
    // The state of devices is sent with the events that refer to it.
    let devices = if looks { states(shared) } else { Vec::new() };
    let _heard = shared.link.send(&frame(&News::Events { events, devices }));
    true
}

fn states(shared: &ProcessorState) -> Vec<(String, DeviceState)> {
    locked(&shared.devices).iter().map(|(name, device)| (name.clone(), DeviceState::of(device))).collect()
}

fn counted(shared: &ProcessorState) -> Vec<(String, DriverCounters)> {
    let counted = locked(&shared.besides).iter().map(|(name, beside)| (name.clone(), beside.counted())).collect::<Vec<_>>();
    counted.into_iter().filter(|(_, counted)| !counted.is_empty()).collect()
}

/// State as last reported, so that only changes are sent.
#[derive(Default)]
struct Beats {
    count: u64,
    devices: HashMap<String, DeviceState>,
    inbounds: HashMap<u64, (Option<i64>, Option<i64>)>,
    /// Number of sampled invocations of each block.
    blocks: HashMap<BlockId, u64>,
    /// Number of rows taken from each ring.
    taken: HashMap<u64, u64>,
}

impl Beats {
    fn take(&mut self, shared: &ProcessorState, now_ns: i64) -> Beat {
        self.count += 1;
        let mut beat = Beat { now_ns, ..Beat::default() };
        if self.count % STATISTICS_EVERY == 1 {
            let sources = locked(&shared.sources).clone();
            beat.sources = sources.into_iter().map(|source| (source, shared.host.statistics(source))).collect();
            beat.blocks = self.block_times(shared);
            beat.counted = counted(shared);
        }
        beat.devices = states(shared).into_iter().filter(|(name, state)| self.devices.insert(name.clone(), state.clone()).as_ref() != Some(state)).collect();
        let inbounds: Vec<_> = locked(&shared.reader).inbounds().map(|(number, inbound)| (number, inbound.brought_ns(), inbound.late_since_ns())).collect();
        self.inbounds.retain(|number, _| inbounds.iter().any(|(known, ..)| known == number));
        beat.inbounds =
            inbounds.into_iter().filter(|(number, brought, late)| self.inbounds.insert(*number, (*brought, *late)) != Some((*brought, *late))).collect();
        beat.rows = self.all_rows(shared);
        beat
    }

    /// Returns the durations of the blocks that the probe has sampled since the last report.
    fn block_times(&mut self, shared: &ProcessorState) -> Vec<(BlockId, BlockTimes)> {
        let times: HashMap<BlockId, BlockTimes> = locked(&shared.reader).blocks().map(|block| (block.id(), block.block_times())).collect();
        self.blocks.retain(|block, _| times.contains_key(block));
        let visited = times.into_iter().filter(|(_, times)| times.samples > 0);
        visited.filter(|(block, times)| self.blocks.insert(*block, times.samples) != Some(times.samples)).collect()
    }

    /// Returns the new rows of each ring.
    fn all_rows(&mut self, shared: &ProcessorState) -> Vec<(u64, Vec<RowAs>)> {
        let mut rings: Vec<_> = locked(&shared.reader).rings().collect();
        self.taken.retain(|number, _| rings.iter().any(|(known, _)| known == number));
        // A source continues from an older ring to a newer one, and a reader of a row of the newer one expects to have all of the older
        // one. The ends are therefore read from the newest ring first, and the rows are sent from the oldest.
        rings.sort_by_key(|(number, _)| *number);
        let ends: Vec<u64> = rings.iter().rev().map(|(_, ring)| ring.written()).collect();
        let mut all = Vec::new();
        for ((number, ring), end) in rings.iter().zip(ends.into_iter().rev()) {
            let rows = self.rows(*number, ring, end);
            let is_through = rows.len() < ROWS_MAX;
            if !rows.is_empty() {
                all.push((*number, rows));
            }
            if !is_through {
                break;
            }
        }
        all
    }

    fn rows(&mut self, number: u64, ring: &RowsReader, end: u64) -> Vec<RowAs> {
        let taken = self.taken.entry(number).or_default();
        let (mut rows, mut row) = (Vec::new(), Row::default());
        while rows.len() < ROWS_MAX
            && *taken < end
            && let Some(lost) = ring.next(*taken, &mut row)
        {
            *taken = row.sequence + 1;
            rows.push((lost, row.number, row.time_ns, std::mem::take(&mut row.bytes)));
        }
        rows
    }
}
