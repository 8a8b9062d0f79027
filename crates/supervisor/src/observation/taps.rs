// SPDX-License-Identifier: Apache-2.0
//! Taps as the supervisor keeps them.
//!
//! A tap has rings of its own, so what others observe, and the histories of SVVs, are not disturbed by it.
use crate::observation::inbox::{Inbox, TapChannel};
use kernel::{Cell, RowsEnd, SourceId};
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Stored values that wait for a tap.
const STORES_MAX: usize = 65_536;

/// A channel, and where it was found last.
pub(crate) struct TappedChannel {
    pub of: TapChannel,
    /// The stamp of its present writer, and how many there were.
    pub stamp: Option<Cell>,
    pub stamps: u64,
}

/// A ring in force, or about to be.
pub(crate) struct Part {
    pub cells: Vec<Cell>,
    pub end: Arc<RowsEnd>,
    pub taken: Arc<AtomicU64>,
}

#[derive(Default)]
pub(crate) struct TapRecord {
    pub channels: Vec<TappedChannel>,
    pub parts: BTreeMap<SourceId, Part>,
    pub inbox: Arc<Inbox>,
    /// Names that it takes in where they come to be; and all private cells.
    pub patterns: Vec<String>,
    pub cells: bool,
    pub names: HashSet<String>,
    /// Under the virtual clock time waits for it.
    pub holds: bool,
    /// Log entries and ends that its owner has taken.
    pub heard: (u64, u64),
}

/// Log entries and ends that may wait for the tap that holds time.
const ENTRIES_WAITING: u64 = 1024;
const ENDS_WAITING: u64 = 256;

/// Every tap of the system.
#[derive(Default)]
pub(crate) struct Taps {
    pub records: BTreeMap<u64, TapRecord>,
}

impl Taps {
    /// Returns a tap for which time is to wait and that has half a ring unread, or whose owner has much of the log. `log`, `ends`: the next numbers
    /// there.
    pub fn full(&self, log: u64, ends: u64) -> Option<Arc<Inbox>> {
        let is_full = |part: &Part| {
            let reader = part.end.reader();
            reader.written().saturating_sub(part.taken.load(Ordering::Relaxed)) > reader.depth() as u64 / 2
        };
        let is_behind = |tap: &TapRecord| log.saturating_sub(tap.heard.0) > ENTRIES_WAITING || ends.saturating_sub(tap.heard.1) > ENDS_WAITING;
        self.records.values().find(|tap| tap.holds && (is_behind(tap) || tap.parts.values().any(is_full))).map(|tap| tap.inbox.clone())
    }

    /// Rings that source `source` writes.
    pub fn rings(&self, source: SourceId) -> impl Iterator<Item = kernel::Rows> + '_ {
        let parts = self.records.values().filter_map(move |tap| tap.parts.get(&source));
        parts.map(|part| kernel::Rows { cells: part.cells.clone(), writer: part.end.clone() })
    }

    /// Notes a value that was stored in an SVV that nothing writes.
    pub fn stored(&self, svv: &str, now_ns: i64, bytes: &[u8]) {
        for tap in self.records.values() {
            for channel in tap.channels.iter().enumerate().filter(|(_, channel)| channel.of.name == svv).map(|(channel, _)| channel) {
                let mut arrived = tap.inbox.locked();
                if arrived.stores.len() < STORES_MAX {
                    arrived.stores.push((channel, now_ns, bytes.to_vec()));
                } else {
                    *arrived.lost.entry(channel).or_default() += 1;
                }
            }
        }
    }

    pub fn hold(&mut self, id: u64, log: u64, ends: u64) {
        if let Some(tap) = self.records.get_mut(&id) {
            (tap.holds, tap.heard) = (true, (log, ends));
        }
    }

    /// Notes that the owner of a tap has taken what stands in the log and the ends before these numbers.
    pub fn heard(&mut self, id: u64, log: u64, ends: u64) {
        if let Some(tap) = self.records.get_mut(&id) {
            tap.heard = (log, ends);
        }
    }
}
