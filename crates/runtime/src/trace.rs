// SPDX-License-Identifier: Apache-2.0
//! A run of a host written down so that it can be run again: every script as bytes, and of every source what came to it from outside.
//!
//! What decides (supervisor, programming system) decides by scripts; what it decided is in them, so nothing of it needs to be run
//! again. Connections within the host are told by name as if their ends were remote, so that the other side can make its own.
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

/// One thing of a record, in the order in which they are needed for running it again.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
pub enum Entry {
    /// A source; they are numbered from 0 in the order in which they come.
    Source(SourceSpec),
    /// A device that the scripts behind this name for the first time.
    Device {
        /// Its name.
        name: String,
        /// Its channels.
        channels: Vec<Channel>,
    },
    /// A script that was handed to a source. It is carried out where a segment says so.
    Script {
        /// Its number in segments.
        number: u64,
        /// The source.
        source: SourceId,
        /// The script, and what it names for the first time.
        parcel: Parcel,
    },
    /// Segment of a source.
    Stretch(SourceId, Stretch),
    /// Cell of an SVV in the image of a source.
    Named {
        /// The source.
        source: SourceId,
        /// The SVV.
        name: String,
        /// Its C type.
        type_text: String,
        /// Its unit, or empty.
        unit: String,
        /// Its cell, which a later script may be the first to name.
        cell: crate::encoding::CellAt,
    },
    /// Mark from which on the record cannot be run again, and why.
    Broken(String),
}

/// Names of blocks' code where the record is run.
pub type CodeNames = Box<dyn Fn(&Block) -> Option<CodeName> + Send>;

/// The record of a host that is being made.
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
    /// The reader is gone: what comes is dropped.
    is_abandoned: bool,
}

impl Scripts {
    fn put(&mut self, entry: Entry) {
        if !self.is_abandoned {
            self.entries.push_back(entry);
        }
    }
}

/// Numbers of connections within the host, beyond those of connections that lead out of it.
const WAYS_WITHIN: u64 = 1 << 40;

impl Trace {
    pub(crate) fn new(names: CodeNames) -> Trace {
        let scripts = Scripts { writer: Writer::default(), names, last: 0, entries: VecDeque::new(), is_broken: false, is_abandoned: false };
        Trace { scripts: Mutex::new(scripts), takers: Mutex::default(), serials: Arc::default(), ways: AtomicU64::new(WAYS_WITHIN) }
    }

    /// Returns the tape of a source that is being made.
    pub(crate) fn tape(&self, id: SourceId, spec: &SourceSpec) -> Arc<SourceTape> {
        let (tape, taker) = SourceTape::recording(self.serials.clone());
        locked(&self.scripts).put(Entry::Source(spec.clone()));
        locked(&self.takers).push((id, taker));
        tape
    }

    /// Returns the name of a connection within the host.
    pub(crate) fn way(&self) -> u64 {
        self.ways.fetch_add(1, Ordering::Relaxed)
    }

    /// Notes that a script is on its way to `source`; returns its number in segments.
    pub(crate) fn script(&self, source: SourceId, script: &Script) -> u64 {
        let mut scripts = locked(&self.scripts);
        let Scripts { writer, names, last, entries, is_broken, is_abandoned } = &mut *scripts;
        *last += 1;
        if *is_abandoned {
            return *last;
        }
        match writer.parcel(script, &**names) {
            Ok(parcel) => {
                // What it names comes before it.
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

    /// Names the `cell` of an SVV's value in the image of `source`.
    pub fn name(&self, source: SourceId, name: &str, type_text: &str, unit: &str, cell: &Cell) {
        let mut scripts = locked(&self.scripts);
        let cell = scripts.writer.place(cell);
        let (name, type_text, unit) = (name.to_owned(), type_text.to_owned(), unit.to_owned());
        scripts.put(Entry::Named { source, name, type_text, unit, cell });
    }

    /// Marks the record as one that cannot be run again from here on.
    pub fn broken(&self, why: &str) {
        let mut scripts = locked(&self.scripts);
        if !std::mem::replace(&mut scripts.is_broken, true) {
            scripts.put(Entry::Broken(why.to_owned()));
        }
    }

    /// Takes what has come since the last call. One thread calls it, often enough: what finds no room is lost, and counted in the next segment.
    pub fn take(&self, out: &mut Vec<Entry>) {
        self.gather();
        out.extend(locked(&self.scripts).entries.drain(..));
    }

    /// Abandons the record, though the host goes on: what comes is given up.
    pub fn abandon(&self) {
        let mut scripts = locked(&self.scripts);
        scripts.is_abandoned = true;
        scripts.entries.clear();
    }

    /// Puts the segments that wait behind the scripts that they may name: under the virtual clock after every firing, so that none is lost
    /// however fast time goes.
    pub(crate) fn gather(&self) {
        // Held all the time: two who gather would mix the order of a source.
        let mut takers = locked(&self.takers);
        // Stretches first: each script that one of them names is an entry already.
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
