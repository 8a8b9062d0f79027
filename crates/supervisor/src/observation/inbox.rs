// SPDX-License-Identifier: Apache-2.0
//! Exchange point between the supervisor and a tap, where rows are handed over.
use kernel::{RowsEnd, SourceId};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::Duration;

/// A value that a tap observes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapChannel {
    /// Name of an SVV, or `INSTANCE:CELL` for a private cell.
    pub name: String,
    /// Normalised type.
    pub type_text: String,
    pub unit: String,
    /// Size of a value, bytes.
    pub size: usize,
}

/// Location of one channel's values in the rows of a ring.
pub(crate) struct Field {
    pub channel: usize,
    /// Offset of the writer's stamp, and the number of this stamp within the channel: a different number means a different writer.
    pub stamp: Option<(usize, u64)>,
    /// n for a ratio output n, otherwise 1.
    pub ratio: u64,
    /// Offset of the value.
    pub value: usize,
}

/// Rows of one ring, from its creation until the next ring of the same source takes effect.
pub(crate) struct Segment {
    pub source: SourceId,
    /// End of the ring, which also keeps the remote processor's end open.
    pub end: Arc<RowsEnd>,
    pub fields: Vec<Field>,
    /// Number of rows taken.
    pub taken: Arc<AtomicU64>,
}

/// Rows handed over from the supervisor to a tap.
#[derive(Default)]
pub(crate) struct TapRows {
    pub segments: Vec<Segment>,
    /// Values that the PS or ψ has stored in an SVV without a writer: (channel, time, bytes).
    pub stores: Vec<(usize, i64, Vec<u8>)>,
    /// Number of lost values, by channel.
    pub lost: BTreeMap<usize, u64>,
    /// Channels added since the last call, to be appended to the earlier ones.
    pub channels: Vec<TapChannel>,
    /// True if time is held until the tap has been read.
    pub pressed: bool,
}

/// Exchange point between the supervisor and a tap. Neither side holds the lock longer than for one insertion or removal.
#[derive(Default)]
pub(crate) struct Inbox {
    arrived: Mutex<TapRows>,
    turned: Condvar,
}

impl Inbox {
    pub fn locked(&self) -> MutexGuard<'_, TapRows> {
        self.arrived.lock().expect("nobody panics with the lock held")
    }

    /// Waits until the tap must be read immediately, but at most until the timeout.
    pub fn wait_pressed(&self, timeout: Duration) {
        let arrived = self.locked();
        drop(self.turned.wait_timeout_while(arrived, timeout, |arrived| !arrived.pressed).expect("nobody panics with the lock held"));
    }

    /// Records that the tap has been read.
    pub fn relieve(&self) {
        self.locked().pressed = false;
        self.turned.notify_all();
    }

    /// Requests that the tap be read, and waits briefly until it has been.
    pub fn press(&self) {
        let mut arrived = self.locked();
        arrived.pressed = true;
        self.turned.notify_all();
        drop(self.turned.wait_timeout_while(arrived, PRESSED_MAX, |arrived| arrived.pressed).expect("nobody panics with the lock held"));
    }
}

/// Maximum time for which a step of the virtual clock waits for a tap before it checks again.
const PRESSED_MAX: Duration = Duration::from_millis(20);
