// SPDX-License-Identifier: Apache-2.0
//! The meeting place of the supervisor and a tap.
use kernel::{RowsEnd, SourceId};
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::Duration;

/// A value that a tap observes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapChannel {
    /// Name of an SVV, or `INSTANCE:CELL` of a private cell.
    pub name: String,
    /// Its normalised type.
    pub type_text: String,
    pub unit: String,
    /// Bytes of a value.
    pub size: usize,
}

/// Offset of the values of one channel in the rows of a ring.
pub(crate) struct Field {
    pub channel: usize,
    /// Offset of its writer's stamp, and which stamp of the channel this is: another one is another writer.
    pub stamp: Option<(usize, u64)>,
    /// n of a ratio output n, else 1.
    pub ratio: u64,
    /// Offset of the value.
    pub value: usize,
}

/// The rows of one ring, from when it was made until the next one of its source is in force.
pub(crate) struct Segment {
    pub source: SourceId,
    /// Kept, so that a remote processor keeps its end of it too.
    pub end: Arc<RowsEnd>,
    pub fields: Vec<Field>,
    /// Rows taken.
    pub taken: Arc<AtomicU64>,
}

/// Rows that the supervisor hands to a tap.
#[derive(Default)]
pub(crate) struct TapRows {
    pub segments: Vec<Segment>,
    /// Values that the PS or ψ stored in an SVV that nothing writes: (channel, time, bytes).
    pub stores: Vec<(usize, i64, Vec<u8>)>,
    /// Number of lost values, by channel.
    pub lost: BTreeMap<usize, u64>,
    /// Channels observed since the last time, behind those observed before.
    pub channels: Vec<TapChannel>,
    /// Time stands still until the tap has been read.
    pub pressed: bool,
}

/// The meeting place of the supervisor and a tap. Neither holds the lock for longer than it takes to put something in or out.
#[derive(Default)]
pub(crate) struct Inbox {
    arrived: Mutex<TapRows>,
    turned: Condvar,
}

impl Inbox {
    pub fn locked(&self) -> MutexGuard<'_, TapRows> {
        self.arrived.lock().expect("nobody panics with the lock held")
    }

    /// Waits until the tap is to be read at once, or the time is over.
    pub fn wait_pressed(&self, timeout: Duration) {
        let arrived = self.locked();
        drop(self.turned.wait_timeout_while(arrived, timeout, |arrived| !arrived.pressed).expect("nobody panics with the lock held"));
    }

    /// Notes that the tap has been read.
    pub fn relieve(&self) {
        self.locked().pressed = false;
        self.turned.notify_all();
    }

    /// Asks for the tap to be read, and waits a little for it.
    pub fn press(&self) {
        let mut arrived = self.locked();
        arrived.pressed = true;
        self.turned.notify_all();
        drop(self.turned.wait_timeout_while(arrived, PRESSED_MAX, |arrived| arrived.pressed).expect("nobody panics with the lock held"));
    }
}

/// Time for which a step of the virtual clock waits for a tap before it looks again.
const PRESSED_MAX: Duration = Duration::from_millis(20);
