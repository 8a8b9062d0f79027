// SPDX-License-Identifier: Apache-2.0
//! Taps as the supervisor keeps them: where each observed value lies now, and the ring of rows that each tap has in each source.
//!
//! A tap has rings of its own, so what others observe, and the histories of SVVs, are not disturbed by it. Where a value gets another
//! home or another writer, the source gets a new ring with its next table, and the tap a new segment; the first row of a ring is written
//! when the table comes into force, so the tap knows that the ring before has got its last row.
use crate::core::Core;
use crate::instance::Instance;
use crate::patterns::{is_open, matches};
use crate::refuse::unknown;
use kernel::{Cell, RowsEnd, SourceId, SourceKind};
use model::interface::Mode;
use model::plan::CellKind;
use model::refusal::Refusals;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::Duration;

/// A value that a tap observes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapChannel {
    /// Of an SVV its name, of a private cell `INSTANCE:CELL`.
    pub name: String,
    /// Its normalised type.
    pub type_text: String,
    pub unit: String,
    /// Bytes of a value.
    pub size: usize,
}

/// Where the values of one channel lie in the rows of a ring.
pub(crate) struct Field {
    pub channel: usize,
    /// Offset of the stamp of who writes it, and which stamp of the channel this is: another one is another writer.
    pub stamp: Option<(usize, u64)>,
    /// n of a ratio output n, else 1.
    pub ratio: u64,
    /// Offset of the value.
    pub value: usize,
}

/// The rows of one ring, from when it was made until the next one of its source is in force.
pub(crate) struct Segment {
    pub source: SourceId,
    /// Kept, so that a processor elsewhere keeps its end of it too.
    pub end: Arc<RowsEnd>,
    pub fields: Vec<Field>,
    /// Rows taken.
    pub taken: Arc<AtomicU64>,
}

/// What the supervisor hands to a tap.
#[derive(Default)]
pub(crate) struct Arrived {
    pub segments: Vec<Segment>,
    /// Values that the PS or ψ stored in an SVV that nothing writes: (channel, time, bytes).
    pub stores: Vec<(usize, i64, Vec<u8>)>,
    /// How many of those were lost, by channel.
    pub lost: BTreeMap<usize, u64>,
    /// What it observes since the last time, behind what it observed before.
    pub channels: Vec<TapChannel>,
    /// Time stands still until the tap has been read.
    pub pressed: bool,
}

/// The meeting place of the supervisor and a tap. Neither holds the lock for longer than it takes to put something in or out.
#[derive(Default)]
pub(crate) struct Inbox {
    arrived: Mutex<Arrived>,
    turned: Condvar,
}

impl Inbox {
    pub fn locked(&self) -> MutexGuard<'_, Arrived> {
        self.arrived.lock().expect("nobody panics with the lock held")
    }

    /// Waits until the tap is to be read at once, or the time is over.
    pub fn wait_pressed(&self, timeout: Duration) {
        let arrived = self.locked();
        drop(self.turned.wait_timeout_while(arrived, timeout, |arrived| !arrived.pressed).expect("nobody panics with the lock held"));
    }

    /// The tap has been read.
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

/// How long a step of the virtual clock waits for a tap before it looks again.
const PRESSED_MAX: Duration = Duration::from_millis(20);
/// Stored values that wait for a tap.
const STORES_MAX: usize = 65_536;
/// What a ring holds: firings of so long a time …
const HELD_NS: u64 = 2_000_000_000;
/// … and so many at the least, of a source that no timer drives, and under the virtual clock, where time waits for who holds it …
const DEPTH_MIN: usize = 256;
const DEPTH_UNTIMED: usize = 4096;
/// … and so many, and bytes, at the most.
const DEPTH_MAX: usize = 65_536;
const BYTES_MAX: usize = 64 << 20;

/// A channel, and where it was found last.
struct Tapped {
    of: TapChannel,
    /// The stamp of its present writer, and how many there were.
    stamp: Option<Cell>,
    stamps: u64,
}

/// A ring in force, or about to be.
struct Part {
    cells: Vec<Cell>,
    end: Arc<RowsEnd>,
    taken: Arc<AtomicU64>,
}

#[derive(Default)]
pub(crate) struct TapRecord {
    channels: Vec<Tapped>,
    parts: BTreeMap<SourceId, Part>,
    inbox: Arc<Inbox>,
    /// Names that it takes in where they come to be; and all private cells.
    patterns: Vec<String>,
    cells: bool,
    names: HashSet<String>,
    /// Under the virtual clock time waits for it.
    holds: bool,
    /// Log entries and ends that its owner has taken.
    heard: (u64, u64),
}

/// Log entries and ends that may wait for who holds time.
const ENTRIES_WAITING: u64 = 1024;
const ENDS_WAITING: u64 = 256;

/// Every tap of the system.
#[derive(Default)]
pub(crate) struct Taps {
    records: BTreeMap<u64, TapRecord>,
}

/// Where a channel's values are written now.
struct Place {
    source: SourceId,
    cell: Cell,
    stamp: Option<Cell>,
    ratio: u64,
}

/// What a ring of one source has to hold: cells in order, length of a row, and where each channel lies.
#[derive(Default)]
struct Layout {
    cells: Vec<Cell>,
    fields: Vec<Field>,
    len: usize,
}

impl Layout {
    /// Appends a cell; its offset.
    fn put(&mut self, cell: &Cell) -> usize {
        let at = self.len;
        self.len += cell.len();
        self.cells.push(cell.clone());
        at
    }
}

impl Taps {
    /// A tap for which time is to wait has half a ring unread, or its owner much of the log. `log`, `ends`: the next numbers there.
    pub fn full(&self, log: u64, ends: u64) -> Option<Arc<Inbox>> {
        let is_full = |part: &Part| {
            let reader = part.end.reader();
            reader.written().saturating_sub(part.taken.load(Ordering::Relaxed)) > reader.depth() as u64 / 2
        };
        let is_behind = |tap: &TapRecord| log.saturating_sub(tap.heard.0) > ENTRIES_WAITING || ends.saturating_sub(tap.heard.1) > ENDS_WAITING;
        self.records.values().find(|tap| tap.holds && (is_behind(tap) || tap.parts.values().any(is_full))).map(|tap| tap.inbox.clone())
    }

    /// Rings that source `source` writes.
    pub fn rings(&self, source: SourceId) -> impl Iterator<Item = kernel::table::Rows> + '_ {
        let parts = self.records.values().filter_map(move |tap| tap.parts.get(&source));
        parts.map(|part| kernel::table::Rows { cells: part.cells.clone(), writer: part.end.clone() })
    }

    /// A value was stored in an SVV that nothing writes.
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

    /// The owner of a tap has taken what stands in the log and the ends before these numbers.
    pub fn heard(&mut self, id: u64, log: u64, ends: u64) {
        if let Some(tap) = self.records.get_mut(&id) {
            tap.heard = (log, ends);
        }
    }
}

/// A tap's number, its channels, where it gets its rings, and the sources whose tables change.
pub(crate) type Attached = (u64, Vec<TapChannel>, Arc<Inbox>, Vec<SourceId>);

impl Core {
    /// Begins to observe.
    pub fn attach(&mut self, names: &[String]) -> Result<Attached, Refusals> {
        let channels = names.iter().map(|name| self.tap_channel(name)).collect::<Result<Vec<_>, _>>()?;
        let (id, inbox) = (self.fresh(), Arc::new(Inbox::default()));
        let tapped = channels.iter().map(|of| Tapped { of: of.clone(), stamp: None, stamps: 0 }).collect();
        self.taps.records.insert(id, TapRecord { channels: tapped, inbox: inbox.clone(), ..TapRecord::default() });
        Ok((id, channels, inbox, self.renew_taps()))
    }

    /// The same of everything of these names, now and whenever it comes to be; a name without `*` or `?` is of something that is there.
    pub fn attach_all(&mut self, patterns: &[String], cells: bool) -> Result<(u64, Arc<Inbox>, Vec<SourceId>), Refusals> {
        for name in patterns.iter().filter(|name| !is_open(name)) {
            self.tap_channel(name)?;
        }
        let (id, inbox) = (self.fresh(), Arc::new(Inbox::default()));
        self.taps.records.insert(id, TapRecord { patterns: patterns.to_vec(), cells, inbox: inbox.clone(), ..TapRecord::default() });
        Ok((id, inbox, self.renew_taps()))
    }

    /// Taps take in what has come to be.
    pub fn widen_taps(&mut self) {
        let mut taps = std::mem::take(&mut self.taps);
        taps.records.values_mut().filter(|tap| tap.cells || !tap.patterns.is_empty()).for_each(|tap| self.widen(tap));
        self.taps = taps;
    }

    fn widen(&self, tap: &mut TapRecord) {
        let is_named = |tap: &TapRecord, name: &str| tap.patterns.iter().any(|pattern| matches(pattern, name));
        let mut found = Vec::new();
        for (name, svv) in &self.svvs {
            if is_named(tap, name) && tap.names.insert(name.clone()) {
                found.push(TapChannel { name: name.clone(), type_text: svv.type_text.clone(), unit: svv.unit.clone(), size: svv.size });
                // Nothing writes it: its present value comes from here.
                if svv.home.is_none() {
                    let channel = tap.channels.len() + found.len() - 1;
                    tap.inbox.locked().stores.push((channel, svv.stored_ns, svv.stored.clone()));
                }
            }
        }
        if tap.cells || tap.patterns.iter().any(|pattern| pattern.contains(':')) {
            for instance in self.instances.values() {
                for cell in &instance.plan.cells {
                    let Some(name) = own_name(&cell.kind).map(|name| format!("{}:{name}", instance.name)) else { continue };
                    if (tap.cells || is_named(tap, &name)) && tap.names.insert(name.clone()) {
                        found.push(TapChannel { name, type_text: cell.type_text.clone(), unit: cell.unit.clone(), size: cell.size });
                    }
                }
            }
        }
        tap.channels.extend(found.iter().map(|of| Tapped { of: of.clone(), stamp: None, stamps: 0 }));
        tap.inbox.locked().channels.extend(found);
    }

    /// Ends it. The sources whose tables change.
    pub fn detach(&mut self, id: u64) -> Vec<SourceId> {
        self.taps.records.remove(&id).map(|tap| tap.parts.into_keys().collect()).unwrap_or_default()
    }

    /// What a name is of: an SVV, or a cell of an instance.
    fn tap_channel(&self, name: &str) -> Result<TapChannel, Refusals> {
        if let Some(svv) = self.svvs.get(name) {
            return Ok(TapChannel { name: name.to_owned(), type_text: svv.type_text.clone(), unit: svv.unit.clone(), size: svv.size });
        }
        let Some((instance, cell)) = name.split_once(':') else {
            return Err(unknown("SVV", name, self.svvs.keys().map(String::as_str)));
        };
        let Some(found) = self.instances.values().find(|of| of.name == instance) else {
            return Err(unknown("verb instance", instance, self.instances.values().map(|of| of.name.as_str())));
        };
        let Some(index) = cell_named(found, cell) else {
            return Err(unknown(&format!("cell of '{instance}'"), cell, found.plan.cells.iter().filter_map(|cell| own_name(&cell.kind))));
        };
        let cell = &found.plan.cells[index];
        Ok(TapChannel { name: name.to_owned(), type_text: cell.type_text.clone(), unit: cell.unit.clone(), size: cell.size })
    }

    /// Makes the rings anew of the sources in which something observed has come, gone or got another writer. The sources whose tables
    /// change.
    pub fn renew_taps(&mut self) -> Vec<SourceId> {
        self.widen_taps();
        let mut changed = Vec::new();
        let mut taps = std::mem::take(&mut self.taps);
        for tap in taps.records.values_mut() {
            let mut layouts = self.layouts(tap);
            let gone: Vec<SourceId> = tap.parts.keys().filter(|source| !layouts.contains_key(source)).copied().collect();
            for source in gone {
                tap.parts.remove(&source);
                changed.push(source);
            }
            while let Some((source, layout)) = layouts.pop_first() {
                if tap.parts.get(&source).is_some_and(|part| is_same(&part.cells, &layout.cells)) {
                    continue;
                }
                let (writer, _) = interconnect::rows(layout.len, self.depth(source, layout.len));
                let (end, taken) = (RowsEnd::new(writer), Arc::new(AtomicU64::new(0)));
                tap.parts.insert(source, Part { cells: layout.cells, end: end.clone(), taken: taken.clone() });
                tap.inbox.locked().segments.push(Segment { source, end, fields: layout.fields, taken });
                changed.push(source);
            }
        }
        self.taps = taps;
        changed.sort();
        changed.dedup();
        changed
    }

    /// What a tap observes, by source: the stamps first, each once.
    fn layouts(&self, tap: &mut TapRecord) -> BTreeMap<SourceId, Layout> {
        let mut places: BTreeMap<SourceId, Vec<(usize, Place)>> = BTreeMap::new();
        let mut found = Found::default();
        for (channel, tapped) in tap.channels.iter_mut().enumerate() {
            let Some(place) = self.place_of(&tapped.of, &mut found) else { continue };
            let is_other = match (&place.stamp, &tapped.stamp) {
                (Some(now), Some(before)) => !now.is_same(before),
                (now, before) => now.is_some() != before.is_some(),
            };
            if is_other {
                tapped.stamp = place.stamp.clone();
                tapped.stamps += 1;
            }
            places.entry(place.source).or_default().push((channel, place));
        }
        let mut layouts = BTreeMap::new();
        for (source, places) in places {
            let mut layout = Layout::default();
            let mut stamps: Vec<(Cell, usize)> = Vec::new();
            let mut offsets = Vec::with_capacity(places.len());
            for stamp in places.iter().map(|(_, place)| &place.stamp) {
                offsets.push(stamp.as_ref().map(|stamp| {
                    stamps.iter().find(|(known, _)| known.is_same(stamp)).map(|(_, at)| *at).unwrap_or_else(|| {
                        let at = layout.put(stamp);
                        stamps.push((stamp.clone(), at));
                        at
                    })
                }));
            }
            for ((channel, place), offset) in places.into_iter().zip(offsets) {
                let value = layout.put(&place.cell);
                let stamp = offset.map(|at| (at, tap.channels[channel].stamps));
                layout.fields.push(Field { channel, stamp, ratio: place.ratio, value });
            }
            layouts.insert(source, layout);
        }
        layouts
    }

    /// None where nothing writes it now, or what is there now is of another type.
    fn place_of<'a>(&'a self, of: &TapChannel, found: &mut Found<'a>) -> Option<Place> {
        if let Some(svv) = self.svvs.get(&of.name) {
            let (source, ratio) = (svv.home?, svv.ratio);
            let cell = svv.cells.get(&source).filter(|_| svv.type_text == of.type_text)?.clone();
            return Some(Place { source, cell, stamp: svv.stamps.get(&source).cloned(), ratio });
        }
        let (name, cell) = of.name.split_once(':')?;
        if !found.contains_key(name) {
            let instance = self.instances.values().find(|instance| instance.name == name)?;
            let cells = instance.plan.cells.iter().enumerate().rev().filter_map(|(index, cell)| Some((own_name(&cell.kind)?, index)));
            found.insert(instance.name.as_str(), (instance, cells.collect()));
        }
        let (instance, index) = found.get(name).and_then(|(instance, cells)| Some((*instance, *cells.get(cell)?)))?;
        let planned = &instance.plan.cells[index];
        if planned.type_text != of.type_text {
            return None;
        }
        let installed = &instance.installed;
        let (block, item) = *planned.writers.first().or(planned.readers.first())?;
        let source = installed.home(&instance.plan, index)?;
        let ratio = match installed.interfaces[block].items[item].mode {
            Mode::Ratio(n) if !planned.writers.is_empty() => u64::from(n),
            _ => 1,
        };
        let own = installed.own_stamps.get(&index).and_then(|stamps| stamps.get(&source)).cloned();
        let stamp = own.or_else(|| (!planned.writers.is_empty()).then(|| installed.stamps[instance.plan.blocks[block].activation].clone()));
        Some(Place { source, cell: installed.cell(index, source)?.clone(), stamp, ratio })
    }

    /// Rows of a ring of rows of `len` bytes.
    fn depth(&self, source: SourceId, len: usize) -> usize {
        let period_ns = match self.specs.get(source.0 as usize).map(|spec| &spec.kind) {
            Some(SourceKind::Timer { period_ns }) => Some((*period_ns).max(1)),
            _ => None,
        };
        let timed = period_ns.map_or(DEPTH_UNTIMED, |period_ns| usize::try_from(HELD_NS / period_ns).unwrap_or(DEPTH_MAX));
        let wanted = if self.host.is_virtual() { timed.max(DEPTH_UNTIMED) } else { timed };
        let room = (BYTES_MAX / (len + ROW_HEADER)).max(2);
        wanted.clamp(DEPTH_MIN, DEPTH_MAX).min(room)
    }
}

/// Instances that were found by their names, with their cells by theirs.
type Found<'a> = HashMap<&'a str, (&'a Instance, HashMap<&'a str, usize>)>;

/// Bytes that a row has beside its cells.
const ROW_HEADER: usize = 24;

fn is_same(these: &[Cell], those: &[Cell]) -> bool {
    these.len() == those.len() && these.iter().zip(those).all(|(this, that)| this.is_same(that))
}

/// The name of a cell that belongs to its instance.
fn own_name(kind: &CellKind) -> Option<&str> {
    match kind {
        CellKind::Private { name } | CellKind::Constant { name } => Some(name),
        CellKind::Svv { .. } | CellKind::Channel { .. } => None,
    }
}

fn cell_named(instance: &Instance, name: &str) -> Option<usize> {
    instance.plan.cells.iter().position(|cell| own_name(&cell.kind) == Some(name))
}
