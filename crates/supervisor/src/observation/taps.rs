// SPDX-License-Identifier: Apache-2.0
//! Taps, on the supervisor's side.
//!
//! A tap has its own rings, and does not affect other observers or the histories of SVVs.
use crate::observation::inbox::{Inbox, TapChannel};
use kernel::{Cell, RowsEnd, SourceId};
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Maximum number of stored values waiting for a tap.
const STORES_MAX: usize = 65_536;

/// A channel with its most recent location.
pub(crate) struct TappedChannel {
    pub of: TapChannel,
    /// Stamp of the current writer; `stamps` counts the stamps so far.
    pub stamp: Option<Cell>,
    pub stamps: u64,
}

/// Ring of one source that has been installed or is about to be installed.
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
    /// Names of items to add when they are created; if `cells` is true, all private cells are added too.
    pub patterns: Vec<String>,
    pub cells: bool,
    pub names: HashSet<String>,
    /// True if the virtual clock waits for the tap.
    pub holds: bool,
    /// Numbers up to which the tap's owner has received log entries and ends.
    pub heard: (u64, u64),
}

/// Maximum number of log entries and ends that may be waiting for a tap that holds time.
const ENTRIES_WAITING: u64 = 1024;
const ENDS_WAITING: u64 = 256;

/// All taps of the system.
#[derive(Default)]
pub(crate) struct Taps {
    pub records: BTreeMap<u64, TapRecord>,
}

impl Taps {
    /// Returns a tap that holds time and has half a ring unread, or whose owner has fallen far behind in receiving log entries or ends.
    /// `log` and `ends` are the numbers of the next log entry and the next end.
    pub fn full(&self, log: u64, ends: u64) -> Option<Arc<Inbox>> {
        let is_full = |part: &Part| {
            let reader = part.end.reader();
            reader.written().saturating_sub(part.taken.load(Ordering::Relaxed)) > reader.depth() as u64 / 2
        };
        let is_behind = |tap: &TapRecord| log.saturating_sub(tap.heard.0) > ENTRIES_WAITING || ends.saturating_sub(tap.heard.1) > ENDS_WAITING;
        self.records.values().find(|tap| tap.holds && (is_behind(tap) || tap.parts.values().any(is_full))).map(|tap| tap.inbox.clone())
    }

    /// Returns the rings that `source` writes.
    pub fn rings(&self, source: SourceId) -> impl Iterator<Item = kernel::Rows> + '_ {
        let parts = self.records.values().filter_map(move |tap| tap.parts.get(&source));
        parts.map(|part| kernel::Rows { cells: part.cells.clone(), writer: part.end.clone() })
    }

    /// Records a value stored in an SVV without a writer.
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

    /// Records that the owner of a tap has received the log entries and ends before these numbers.
    pub fn heard(&mut self, id: u64, log: u64, ends: u64) {
        if let Some(tap) = self.records.get_mut(&id) {
            tap.heard = (log, ends);
        }
    }
}
