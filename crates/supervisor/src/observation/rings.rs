// SPDX-License-Identifier: Apache-2.0
//! Locations of observed values: the rings of rows that taps have in each source.
//!
//! If the home or the writer of a value changes, the source receives a new ring with its next table, and the tap a new segment. The first
//! row of a ring is written when the table takes effect, so the tap knows that the last row of the previous ring has been written.
use crate::instances::instance::Instance;
use crate::instances::table::Instances;
use crate::observation::inbox::{Field, Inbox, Segment, TapChannel};
use crate::observation::taps::{Part, TapRecord, TappedChannel, Taps};
use crate::patterns::{is_open, matches};
use crate::refuse::unknown;
use crate::registry::Registry;
use kernel::{Cell, RowsEnd, SourceId, SourceKind};
use model::interface::Mode;
use model::plan::CellKind;
use model::refusal::Refusals;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// Source and offset to which a channel's values are currently written.
struct ChannelCells {
    source: SourceId,
    cell: Cell,
    stamp: Option<Cell>,
    ratio: u64,
}

/// Layout of a ring of one source: its cells in order, the length of a row, and the offset of each channel.
#[derive(Default)]
struct Layout {
    cells: Vec<Cell>,
    fields: Vec<Field>,
    len: usize,
}

impl Layout {
    /// Appends a cell and returns its offset.
    fn put(&mut self, cell: &Cell) -> usize {
        let at = self.len;
        self.len += cell.len();
        self.cells.push(cell.clone());
        at
    }
}

/// A tap's channels, the inbox for its rings, and the sources whose tables change.
pub(crate) type TapAttachment = (Vec<TapChannel>, Arc<Inbox>, Vec<SourceId>);

/// All observable items.
pub(crate) struct Observables<'a> {
    pub registry: &'a Registry,
    pub instances: &'a Instances,
    pub is_virtual: bool,
}

/// Instances found so far by name, with their cells by name.
type FoundInstances<'a> = HashMap<&'a str, (&'a Instance, HashMap<&'a str, usize>)>;

/// Size of a row's header, bytes.
const ROW_HEADER: usize = 24;

fn is_same(these: &[Cell], those: &[Cell]) -> bool {
    these.len() == those.len() && these.iter().zip(those).all(|(this, that)| this.is_same(that))
}

/// Returns the name of a private cell or constant of an instance; `None` for an SVV or a channel.
fn own_name(kind: &CellKind) -> Option<&str> {
    match kind {
        CellKind::Private { name } | CellKind::Constant { name } => Some(name),
        CellKind::Svv { .. } | CellKind::Channel { .. } => None,
    }
}

fn cell_named(instance: &Instance, name: &str) -> Option<usize> {
    instance.plan.cells.iter().position(|cell| own_name(&cell.kind) == Some(name))
}

/// Time span covered by a ring, ns.
const HELD_NS: u64 = 2_000_000_000;

/// Minimum number of firings in a ring. [`DEPTH_UNTIMED`] applies to a source without a timer, and under the virtual clock, where time
/// waits for the tap.
const DEPTH_MIN: usize = 256;

const DEPTH_UNTIMED: usize = 4096;

/// Maximum number of firings in a ring, whose size in bytes is also limited.
const DEPTH_MAX: usize = 65_536;

const BYTES_MAX: usize = 64 << 20;

impl Taps {
    /// Attaches a tap to the items with these names.
    pub fn attach(&mut self, id: u64, names: &[String], seen: &Observables<'_>) -> Result<TapAttachment, Refusals> {
        let channels = names.iter().map(|name| tap_channel(seen, name)).collect::<Result<Vec<_>, _>>()?;
        let inbox = Arc::new(Inbox::default());
        let tapped = channels.iter().map(|of| TappedChannel { of: of.clone(), stamp: None, stamps: 0 }).collect();
        self.records.insert(id, TapRecord { channels: tapped, inbox: inbox.clone(), ..TapRecord::default() });
        Ok((channels, inbox, self.renew(seen)))
    }

    /// Attaches a tap to all items that match these names, including those created later. A name without `*` or `?` must exist.
    pub fn attach_all(&mut self, id: u64, patterns: &[String], cells: bool, seen: &Observables<'_>) -> Result<(Arc<Inbox>, Vec<SourceId>), Refusals> {
        for name in patterns.iter().filter(|name| !is_open(name)) {
            tap_channel(seen, name)?;
        }
        let inbox = Arc::new(Inbox::default());
        self.records.insert(id, TapRecord { patterns: patterns.to_vec(), cells, inbox: inbox.clone(), ..TapRecord::default() });
        Ok((inbox, self.renew(seen)))
    }

    /// Detaches a tap. Returns the sources whose tables change.
    pub fn detach(&mut self, id: u64) -> Vec<SourceId> {
        self.records.remove(&id).map(|tap| tap.parts.into_keys().collect()).unwrap_or_default()
    }

    /// Adds newly matching items to the taps.
    pub fn widen(&mut self, seen: &Observables<'_>) {
        self.records.values_mut().filter(|tap| tap.cells || !tap.patterns.is_empty()).for_each(|tap| widen(seen, tap));
    }

    /// Replaces the rings of the sources in which an observed item was added, removed, or assigned another writer. Returns the sources
    /// whose tables change.
    pub fn renew(&mut self, seen: &Observables<'_>) -> Vec<SourceId> {
        self.widen(seen);
        let mut changed = Vec::new();
        for tap in self.records.values_mut() {
            let mut layouts = layouts(seen, tap);
            let gone: Vec<SourceId> = tap.parts.keys().filter(|source| !layouts.contains_key(source)).copied().collect();
            for source in gone {
                tap.parts.remove(&source);
                changed.push(source);
            }
            while let Some((source, layout)) = layouts.pop_first() {
                if tap.parts.get(&source).is_some_and(|part| is_same(&part.cells, &layout.cells)) {
                    continue;
                }
                let (writer, _) = interconnect::rows(layout.len, depth(seen, source, layout.len));
                let (end, taken) = (RowsEnd::new(writer), Arc::new(AtomicU64::new(0)));
                tap.parts.insert(source, Part { cells: layout.cells, end: end.clone(), taken: taken.clone() });
                tap.inbox.locked().segments.push(Segment { source, end, fields: layout.fields, taken });
                changed.push(source);
            }
        }
        changed.sort();
        changed.dedup();
        changed
    }
}

fn widen(seen: &Observables<'_>, tap: &mut TapRecord) {
    let is_named = |tap: &TapRecord, name: &str| tap.patterns.iter().any(|pattern| matches(pattern, name));
    let mut found = Vec::new();
    for (name, svv) in &seen.registry.svvs {
        if is_named(tap, name) && tap.names.insert(name.clone()) {
            found.push(TapChannel { name: name.clone(), type_text: svv.type_text.clone(), unit: svv.unit.clone(), size: svv.size });
            // The SVV has no writer: take its current value from here.
            if svv.home.is_none() {
                let channel = tap.channels.len() + found.len() - 1;
                tap.inbox.locked().stores.push((channel, svv.past.stored_ns, svv.past.stored.clone()));
            }
        }
    }
    if tap.cells || tap.patterns.iter().any(|pattern| pattern.contains(':')) {
        for instance in seen.instances.values() {
            for cell in &instance.plan.cells {
                let Some(name) = own_name(&cell.kind).map(|name| format!("{}:{name}", instance.name)) else { continue };
                if (tap.cells || is_named(tap, &name)) && tap.names.insert(name.clone()) {
                    found.push(TapChannel { name, type_text: cell.type_text.clone(), unit: cell.unit.clone(), size: cell.size });
                }
            }
        }
    }
    tap.channels.extend(found.iter().map(|of| TappedChannel { of: of.clone(), stamp: None, stamps: 0 }));
    tap.inbox.locked().channels.extend(found);
}

/// Returns the channel with this name: an SVV, or a cell of an instance.
fn tap_channel(seen: &Observables<'_>, name: &str) -> Result<TapChannel, Refusals> {
    if let Some(svv) = seen.registry.svvs.get(name) {
        return Ok(TapChannel { name: name.to_owned(), type_text: svv.type_text.clone(), unit: svv.unit.clone(), size: svv.size });
    }
    let Some((instance, cell)) = name.split_once(':') else {
        return Err(unknown("SVV", name, seen.registry.svvs.keys().map(String::as_str)));
    };
    let Some(found) = seen.instances.values().find(|of| of.name == instance) else {
        return Err(unknown("verb instance", instance, seen.instances.values().map(|of| of.name.as_str())));
    };
    let Some(index) = cell_named(found, cell) else {
        return Err(unknown(&format!("cell of '{instance}'"), cell, found.plan.cells.iter().filter_map(|cell| own_name(&cell.kind))));
    };
    let cell = &found.plan.cells[index];
    Ok(TapChannel { name: name.to_owned(), type_text: cell.type_text.clone(), unit: cell.unit.clone(), size: cell.size })
}

/// Returns the layouts of a tap, by source: each distinct stamp first, then the values.
fn layouts(seen: &Observables<'_>, tap: &mut TapRecord) -> BTreeMap<SourceId, Layout> {
    let mut places: BTreeMap<SourceId, Vec<(usize, ChannelCells)>> = BTreeMap::new();
    let mut found = FoundInstances::default();
    for (channel, tapped) in tap.channels.iter_mut().enumerate() {
        let Some(place) = place_of(seen, &tapped.of, &mut found) else { continue };
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

/// Returns the location of a channel; `None` if it is not currently written, or if its type has changed.
fn place_of<'a>(seen: &Observables<'a>, of: &TapChannel, found: &mut FoundInstances<'a>) -> Option<ChannelCells> {
    if let Some(svv) = seen.registry.svvs.get(&of.name) {
        let (source, ratio) = (svv.home?, svv.ratio);
        let cell = svv.cells.get(&source).filter(|_| svv.type_text == of.type_text)?.clone();
        return Some(ChannelCells { source, cell, stamp: svv.stamps.get(&source).cloned(), ratio });
    }
    let (name, cell) = of.name.split_once(':')?;
    if !found.contains_key(name) {
        let instance = seen.instances.values().find(|instance| instance.name == name)?;
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
    Some(ChannelCells { source, cell: installed.cell(index, source)?.clone(), stamp, ratio })
}

/// Returns the number of rows of `len` bytes that fit into a ring.
fn depth(seen: &Observables<'_>, source: SourceId, len: usize) -> usize {
    let period_ns = match seen.registry.specs.get(source.0 as usize).map(|spec| &spec.kind) {
        Some(SourceKind::Timer { period_ns }) => Some((*period_ns).max(1)),
        _ => None,
    };
    let timed = period_ns.map_or(DEPTH_UNTIMED, |period_ns| usize::try_from(HELD_NS / period_ns).unwrap_or(DEPTH_MAX));
    let wanted = if seen.is_virtual { timed.max(DEPTH_UNTIMED) } else { timed };
    let room = (BYTES_MAX / (len + ROW_HEADER)).max(2);
    wanted.clamp(DEPTH_MIN, DEPTH_MAX).min(room)
}
