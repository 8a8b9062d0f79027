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
    /// Releases at epoch + k · period; all timers of the host share its epoch.
    Timer { period_ns: u64 },
    /// Fires on request by a connection from another source, by a device, or by the PS (`Host::request`), like a trigger. Each request
    /// causes one firing.
    Software,
}

/// Specification of a source.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct SourceSpec {
    /// Processor on which the source runs.
    pub rtp: u16,
    /// Human-readable name.
    pub name: String,
    /// Origin of the requests for the source's firings.
    pub kind: SourceKind,
    /// Priority from 1 (lowest) to 98; used as the SCHED_FIFO priority if the process has the privilege.
    pub priority: u8,
    /// Core to which the source's thread is pinned.
    pub core: Option<usize>,
    /// Cost of one firing under the virtual clock, ns (0: none). With a cost, sources of higher priority preempt the firing at step
    /// boundaries and inside publications, at points chosen by the host's seed.
    pub virtual_cost_ns: u64,
}

/// Pending requests for firings of one source.
#[derive(Default)]
pub struct Requests {
    /// Number of requests not yet served by a firing.
    pub pending: AtomicU64,
    /// Arrival time of the first pending request, under the virtual clock.
    pub since_ns: AtomicU64,
    /// Bell on which the source's thread sleeps.
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
