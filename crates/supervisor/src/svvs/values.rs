// SPDX-License-Identifier: Apache-2.0
//! Values of SVVs: snapshots and stores.
use crate::core::Core;
use crate::instances::instance::State;
use crate::movements::sequence::by_source;
use crate::observation::kept::KeptHistory;
use crate::observation::stamp::Stamp;
use crate::refuse::{refuse, unknown};
use crate::registry::PhysicalRecord;
use crate::scripts::{Purpose, Ticket};
use crate::svvs::named::other_cell;
use device::Direction;
use kernel::{Cell, Op, SourceId};
use model::refusal::{Class, Refusals};
use model::value::Value;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

/// Index of an SVV in a snapshot, its size in bytes, and n of its writer's ratio output if a stamp follows.
type AskedSvv = (usize, usize, Option<u64>);

/// Index of an SVV in a snapshot, its cell, and its stamp, with n of its writer's ratio output.
type KnownCell = (usize, Cell, Option<(Cell, u64)>);

/// A snapshot in progress.
pub(crate) struct Snapshot {
    /// Ticket of each queried source, and the SVVs requested from it.
    pub asked: Vec<(Ticket, Vec<AskedSvv>)>,
    /// Sources to which the queries with these tickets were sent.
    pub sources: Vec<SourceId>,
    /// Values known without querying a kernel: (index, bytes, time).
    pub known: Vec<(usize, Vec<u8>, i64)>,
}

/// Value, number and time of an SVV.
pub type Reading = (Vec<u8>, u64, i64);

fn take<'a>(rest: &mut &'a [u8], len: usize) -> &'a [u8] {
    let (head, tail) = rest.split_at(len.min(rest.len()));
    *rest = tail;
    head
}

/// Queries the kernels for the current values of these SVVs: all SVVs of one source at one boundary.
pub(crate) fn ask_for(core: &mut Core, names: &[String]) -> Result<Snapshot, Refusals> {
    let mut by_source: BTreeMap<SourceId, Vec<KnownCell>> = BTreeMap::new();
    let mut known = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let (name, svv) = core.registry.asked(name)?;
        let Some(svv) = svv else {
            let named = other_cell(core, name).ok_or_else(|| unknown("SVV", name, core.registry.svvs.keys().map(String::as_str)))?;
            if core.safety.lost.contains(&named.source) {
                let why = format!("cannot read '{name}': source '{}' is lost", core.registry.source_name(named.source));
                return Err(refuse(Class::InvalidState, why, "see the log for the reason, then call reset()"));
            }
            check_channel(core, name)?;
            by_source.entry(named.source).or_default().push((index, named.cell, named.stamp));
            continue;
        };
        match svv.home.and_then(|home| Some((home, svv.cells.get(&home)?))) {
            Some((home, _)) if core.safety.lost.contains(&home) => {
                let why = format!("cannot read SVV '{name}': source '{}', which writes it, is lost", core.registry.source_name(home));
                return Err(refuse(Class::InvalidState, why, "see the log for the reason, then call reset()"));
            }
            Some((home, cell)) => {
                // The value is stamped where it is stored, even behind a ratio output.
                by_source.entry(home).or_default().push((index, cell.clone(), svv.stamps.get(&home).map(|stamp| (stamp.clone(), 1))));
            }
            None => known.push((index, svv.past.stored.clone(), svv.past.stored_ns)),
        }
    }
    let sources = by_source.keys().copied().collect();
    let mut asked = Vec::new();
    for (source, cells) in by_source {
        let ticket = Ticket(core.numbers.fresh());
        let layout = cells.iter().map(|(index, cell, stamp)| (*index, cell.len(), stamp.as_ref().map(|(_, ratio)| *ratio))).collect();
        let capture = cells.into_iter().flat_map(|(_, cell, stamp)| std::iter::once(cell).chain(stamp.map(|(stamp, _)| stamp))).collect();
        core.submit(source, vec![Op::Capture(capture)], Purpose::Read { ticket });
        asked.push((ticket, layout));
    }
    Ok(Snapshot { asked, sources, known })
}

/// Returns the channel with this name: its device, its record, and its index.
fn channel<'a>(core: &'a Core, name: &str) -> Option<(&'a str, &'a PhysicalRecord, &'a device::Channel)> {
    core.registry.physical.iter().find_map(|(device, record)| {
        let of = name.strip_prefix(device.as_str())?.strip_prefix('.')?;
        Some((device.as_str(), record, record.device.channels().iter().find(|channel| channel.name == of)?))
    })
}

/// Refuses a channel whose device is lost or has not been read yet, because its value would not reflect the machine.
fn check_channel(core: &Core, name: &str) -> Result<(), Refusals> {
    let Some((device, record, channel)) = channel(core, name) else { return Ok(()) };
    if let Some(lost) = &record.lost {
        let age_s = core.host.now_ns().saturating_sub(record.lost_ns).max(0) as f64 * 1e-9;
        let why = format!("cannot read channel '{name}': its last reading is more than {age_s:.3} s old, because device '{device}' is lost: {lost}");
        return Err(refuse(Class::DeviceFailed, why, "remove the cause, then call reset()"));
    }
    if channel.direction == Direction::Read && !has_reading(core, record) {
        let source = core.registry.source_name(record.source);
        let why = format!("cannot read channel '{name}': there is no reading yet, because source '{source}' has not fired since device '{device}' was opened");
        return Err(refuse(Class::InvalidState, why, "let time pass first, for example advance(\"10 ms\")"));
    }
    Ok(())
}

/// Returns true if a device has been read since it was opened. Remote devices do not report this.
fn has_reading(core: &Core, record: &PhysicalRecord) -> bool {
    record.device.standing().read.load(Ordering::Acquire) || core.remote.at(core.registry.source_name(record.source)).is_some()
}

/// Returns true if all of these channels that belong to an open device have a reading.
pub(crate) fn are_read(core: &Core, names: &[String]) -> bool {
    let open = |name: &String| {
        let (name, svv) = core.registry.asked(name).ok()?;
        channel(core, name).filter(|(_, record, _)| svv.is_none() && record.lost.is_none())
    };
    names.iter().filter_map(open).all(|(_, record, of)| of.direction == Direction::Write || has_reading(core, record))
}

/// Returns the snapshot once every kernel has answered: its time, and the readings in the order requested.
pub(crate) fn taken(core: &mut Core, snapshot: &Snapshot, count: usize) -> Option<(i64, Vec<Reading>)> {
    if !snapshot.asked.iter().all(|(ticket, _)| core.observation.reads.contains_key(ticket)) {
        return None;
    }
    let mut readings: Vec<Reading> = vec![Default::default(); count];
    let mut time_ns = if snapshot.asked.is_empty() { core.host.now_ns() } else { 0 };
    for (index, bytes, at) in &snapshot.known {
        readings[*index] = (bytes.clone(), 0, *at);
    }
    for (ticket, layout) in &snapshot.asked {
        let (at, bytes) = core.observation.reads.remove(ticket)?;
        time_ns = time_ns.max(at);
        let mut rest = bytes.as_slice();
        for (index, len, ratio) in layout {
            let value = take(&mut rest, *len);
            let (number, stamp_ns) = ratio.map_or((0, at), |ratio| {
                let stamp = Stamp::of(take(&mut rest, kernel::STAMP_LEN));
                (stamp.stored(ratio).unwrap_or(0), if stamp.is_set() { stamp.time_ns } else { 0 })
            });
            readings[*index] = (value.to_vec(), number, stamp_ns);
        }
    }
    Some((time_ns, readings))
}

/// Returns the refusal of a read for which some sources did not answer. Values can be read only between invocations.
pub(crate) fn unanswered(core: &Core, snapshot: &Snapshot) -> Refusals {
    let silent = snapshot.asked.iter().zip(&snapshot.sources).find(|((ticket, _), _)| !core.observation.reads.contains_key(ticket));
    let source = silent.map(|(_, source)| *source);
    let runs = source.map(|source| blocks_on(core, source)).unwrap_or_default();
    let runs = if runs.is_empty() { String::new() } else { format!(": {} may be in the middle of an invocation", runs.join(" or ")) };
    let source = source.map_or_else(|| "a kernel".to_owned(), |source| format!("source '{}'", core.registry.source_name(source)));
    refuse(
        Class::InvalidState,
        format!("{source} did not answer{runs}"),
        "read it again later, or read its history, which needs no answer; see statistics() for the duration of a firing",
    )
}

/// Returns the names, for messages, of the active blocks on a source.
fn blocks_on(core: &Core, source: SourceId) -> Vec<String> {
    let mut found = Vec::new();
    for instance in core.instances.values().filter(|instance| instance.state() == State::Running) {
        for (activation, _) in instance.position.active.iter().filter(|(activation, _)| instance.installed.activation_source[*activation] == source) {
            let labels = instance.plan.activations[*activation].blocks.iter().map(|block| &instance.plan.blocks[*block].label);
            found.extend(labels.map(|label| format!("block '{label}' of '{}'", instance.name)));
        }
    }
    found
}

/// Discards the answer to a snapshot whose caller has stopped waiting.
pub(crate) fn forget_snapshot(core: &mut Core, snapshot: &Snapshot) {
    for (ticket, _) in &snapshot.asked {
        core.observation.reads.remove(ticket);
        core.scripts.give_up(*ticket);
    }
}

/// Stores a value from the PS; refused if an instance has claimed the SVV.
pub(crate) fn store_value(core: &mut Core, name: &str, value: &Value) -> Result<(), Refusals> {
    let name = core.registry.name_of(name)?;
    let svv = core.registry.svvs.get(name).ok_or_else(|| unknown("SVV", name, core.registry.svvs.keys().map(String::as_str)))?;
    let claim = model::plan::Claim::Svv { id: svv.id, name: name.to_owned() };
    if let Some(holder) = core.registry.claims.get(&claim).and_then(|h| core.instances.get(h)) {
        return Err(refuse(Class::SecondWriter, format!("cannot store into SVV '{name}': it is written by '{}'", holder.name), "wait for it or halt it"));
    }
    let bytes = crate::starting::psi::encode(&svv.type_text, &svv.unit, value).map_err(|r| vec![crate::starting::psi::named(r, name)])?;
    let range = svv.within.unwrap_or_else(|| model::range::plausible(&svv.unit));
    range.check(&format!("SVV '{name}'"), &svv.unit, value).map_err(|refusal| vec![refusal])?;
    for (source, ops) in by_source(core.carrier().store_everywhere(name, &bytes)) {
        core.submit(source, ops, Purpose::Nothing);
    }
    Ok(())
}

/// Returns the history of an SVV at this instant.
pub(crate) fn kept(core: &Core, name: &str) -> Result<KeptHistory, Refusals> {
    let name = core.registry.name_of(name)?;
    let svv = core.registry.svvs.get(name).ok_or_else(|| unknown("SVV", name, core.registry.svvs.keys().map(String::as_str)))?;
    if svv.past.history == 0 {
        return Err(refuse(Class::ValueRefused, format!("SVV '{name}' has no history"), "declare one: cell.svv(…, history=100)"));
    }
    let rings = svv.past.rings.iter().map(|(source, ring)| (*source, ring.clone(), ring.reader().written())).collect();
    Ok(KeptHistory { history: svv.past.history as usize, rings, stays: svv.past.stays.clone(), stores: svv.past.stores.clone() })
}
