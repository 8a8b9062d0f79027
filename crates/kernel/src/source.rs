// SPDX-License-Identifier: Apache-2.0
//! Interrupt sources.
use crate::bell::Bell;
use std::sync::atomic::{AtomicU64, Ordering};

/// Index of a source in its host.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct SourceId(pub u32);

/// Origin of the requests for a source's firings.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum SourceKind {
    /// Releases at epoch + k · period; the epoch is the host's, the same for all of its timers.
    Timer { period_ns: u64 },
    /// Fires on request: by another source's connection, by a device, by the PS (`Host::request`). A trigger is one. Each request causes
    /// one firing.
    Software,
}

/// Specification of a source.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct SourceSpec {
    /// Processor on which it runs.
    pub rtp: u16,
    /// Human-readable name.
    pub name: String,
    /// Origin of the requests for its firings.
    pub kind: SourceKind,
    /// Priority from 1 (lowest) to 98; used as SCHED_FIFO priority if the rights are granted.
    pub priority: u8,
    /// Core to pin its thread to.
    pub core: Option<usize>,
    /// Cost of one firing under the virtual clock, ns (0: none): sources of higher priority then preempt it at step boundaries and inside
    /// publications, chosen by the host's seed.
    pub virtual_cost_ns: u64,
}

/// Requests of one source, with which others raise it.
#[derive(Default)]
pub struct Requests {
    /// Number of requests not yet served by a firing.
    pub pending: AtomicU64,
    /// Virtual clock: arrival time of the first pending request.
    pub since_ns: AtomicU64,
    /// Bell on which its thread sleeps.
    pub bell: Bell,
}

impl Requests {
    /// Counts a request at `now_ns`. Real-time safe; wake the source afterwards.
    pub fn request(&self, now_ns: i64) {
        if self.pending.load(Ordering::SeqCst) == 0 {
            self.since_ns.store(now_ns as u64, Ordering::SeqCst);
        }
        self.pending.fetch_add(1, Ordering::SeqCst);
        self.bell.mark();
    }
}
