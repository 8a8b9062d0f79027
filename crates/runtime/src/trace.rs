// SPDX-License-Identifier: Apache-2.0
//! Record of a run of a host, for replay: every script as bytes and, for every source, its external inputs.
//!
//! All decisions (of the supervisor and the programming system) take effect through scripts, so the deciding parts need not be replayed.
//! Connections within the host are identified as if their ends were remote, so that the replaying side can create its own.
pub(crate) mod tape;
mod taped;

pub use tape::Stretch;
pub(crate) use taped::TapedReceiver;

use crate::encoding::{CodeName, Parcel, Writer};
use crate::locked::locked;
use device::Channel;
use tape::{SourceTape, Taker};

use kernel::{Block, Cell, Script, SourceId, SourceSpec};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Entry of a record, in the order needed for replay.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub enum Entry {
    /// A source, numbered from 0 in the order of the entries.
    Source(SourceSpec),
    /// A device to which subsequent scripts refer for the first time.
    Device {
        /// Name of the device.
        name: String,
        /// Channels of the device.
        channels: Vec<Channel>,
    },
    /// A script submitted to a source. It is carried out in the segment that refers to it.
    Script {
        /// Number by which segments refer to the script.
        number: u64,
        /// Source that carries out the script.
        source: SourceId,
        /// The script, and the objects to which it refers for the first time.
        parcel: Parcel,
    },
    /// Segment of a source.
    Stretch(SourceId, Stretch),
    /// Cell of an SVV in the image of a source.
    Named {
        /// Source whose image contains the cell.
        source: SourceId,
        /// Name of the SVV.
        name: String,
        /// C type of the SVV.
        type_text: String,
        /// Unit of the SVV, or empty.
        unit: String,
        /// Cell of the value. A later script may be the first to refer to it.
        cell: crate::encoding::CellAt,
    },
    /// Point from which the record cannot be replayed, with the reason.
    Broken(String),
}

/// Lookup of the names of blocks' code in the replaying process.
pub type CodeNames = Box<dyn Fn(&Block) -> Option<CodeName> + Send>;

/// Record of a host that is being recorded.
pub struct Trace {
    scripts: Mutex<Scripts>,
    takers: Mutex<Vec<(SourceId, Taker)>>,
    serials: Arc<AtomicU64>,
    ways: AtomicU64,
}

struct Scripts {
    writer: Writer,
    names: CodeNames,
    last: u64,
    entries: VecDeque<Entry>,
    is_broken: bool,
    /// True if the reader has disconnected, so that new entries are dropped.
    is_abandoned: bool,
}

impl Scripts {
    fn put(&mut self, entry: Entry) {
        if !self.is_abandoned {
            self.entries.push_back(entry);
        }
    }
}

/// First number of connections within the host; connections that leave the host have lower numbers.
const WAYS_WITHIN: u64 = 1 << 40;

impl Trace {
    pub(crate) fn new(names: CodeNames) -> Trace {
        let scripts = Scripts { writer: Writer::default(), names, last: 0, entries: VecDeque::new(), is_broken: false, is_abandoned: false };
        Trace { scripts: Mutex::new(scripts), takers: Mutex::default(), serials: Arc::default(), ways: AtomicU64::new(WAYS_WITHIN) }
    }

    /// Returns the tape for a source that is being created.
    pub(crate) fn tape(&self, id: SourceId, spec: &SourceSpec) -> Arc<SourceTape> {
        let (tape, taker) = SourceTape::recording(self.serials.clone());
        locked(&self.scripts).put(Entry::Source(spec.clone()));
        locked(&self.takers).push((id, taker));
        tape
    }

    /// Returns the number of a new connection within the host.
    pub(crate) fn way(&self) -> u64 {
        self.ways.fetch_add(1, Ordering::Relaxed)
    }

    /// Records a script submitted to `source`; returns its number in segments.
    pub(crate) fn script(&self, source: SourceId, script: &Script) -> u64 {
        let mut scripts = locked(&self.scripts);
        let Scripts { writer, names, last, entries, is_broken, is_abandoned } = &mut *scripts;
        *last += 1;
        if *is_abandoned {
            return *last;
        }
        match writer.parcel(script, &**names) {
            Ok(parcel) => {
                // Objects that it names precede it.
                entries.extend(writer.take_devices().into_iter().map(|(name, channels)| Entry::Device { name, channels }));
                entries.push_back(Entry::Script { number: *last, source, parcel });
            }
            Err(why) if !*is_broken => {
                *is_broken = true;
                entries.push_back(Entry::Broken(why));
            }
            Err(_) => {}
        }
        *last
    }

    /// Records the name of an SVV, whose value is `cell` in the image of `source`.
    pub fn name(&self, source: SourceId, name: &str, type_text: &str, unit: &str, cell: &Cell) {
        let mut scripts = locked(&self.scripts);
        let cell = scripts.writer.place(cell);
        let (name, type_text, unit) = (name.to_owned(), type_text.to_owned(), unit.to_owned());
        scripts.put(Entry::Named { source, name, type_text, unit, cell });
    }

    /// Marks the record as impossible to replay from this point.
    pub fn broken(&self, why: &str) {
        let mut scripts = locked(&self.scripts);
        if !std::mem::replace(&mut scripts.is_broken, true) {
            scripts.put(Entry::Broken(why.to_owned()));
        }
    }

    /// Appends the entries recorded since the last call to `out`. Call this regularly, and from one thread only: when the buffer is full,
    /// segments are dropped, and the next segment records how many.
    pub fn take(&self, out: &mut Vec<Entry>) {
        self.gather();
        out.extend(locked(&self.scripts).entries.drain(..));
    }

    /// Abandons the record while the host continues: new entries are dropped.
    pub fn abandon(&self) {
        let mut scripts = locked(&self.scripts);
        scripts.is_abandoned = true;
        scripts.entries.clear();
    }

    /// Moves waiting segments after the scripts to which they may refer. Called after every firing under the virtual clock, so that no
    /// segment is lost however fast time advances.
    pub(crate) fn gather(&self) {
        // Held throughout: two concurrent calls would mix the order of a source.
        let mut takers = locked(&self.takers);
        // Segments first, so that each script that one of them names is already an entry.
        let mut stretches = Vec::new();
        for (source, taker) in takers.iter_mut() {
            while let Some(stretch) = taker.take() {
                stretches.push((*source, stretch));
            }
        }
        stretches.sort_by_key(|(_, stretch)| stretch.serial);
        let mut scripts = locked(&self.scripts);
        stretches.into_iter().for_each(|(source, stretch)| scripts.put(Entry::Stretch(source, stretch)));
    }
}
