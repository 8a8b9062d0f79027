// SPDX-License-Identifier: Apache-2.0
//! Values of SVVs: snapshots, stores, histories.
use crate::core::{Core, Purpose};
use crate::instance::State;
use crate::refuse::{refuse, unknown};
use crate::sequence::by_source;
use crate::svvs::{Stored, SvvRecord};
use interconnect::Row;
use kernel::{Cell, Op, RowsEnd, SourceId};
use model::refusal::{Class, Refusals};
use model::value::Value;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Index of an SVV in a snapshot, its bytes, and where a stamp follows, n of its writer's ratio output.
type Asked = (usize, usize, Option<u64>);

/// Index of an SVV in a snapshot, its cell, and its stamp with n of its writer's ratio output.
type Wanted = (usize, Cell, Option<(Cell, u64)>);

/// A snapshot that is under way.
pub(crate) struct Snapshot {
    /// For each source that was asked: the ticket, and what was asked for.
    pub asked: Vec<(u64, Vec<Asked>)>,
    /// The sources of these.
    pub sources: Vec<SourceId>,
    /// What needs no asking: (index, bytes, time).
    pub known: Vec<(usize, Vec<u8>, i64)>,
}

/// Value, number and time of an SVV.
pub type Reading = (Vec<u8>, u64, i64);

impl Core {
    /// Asks the kernels for the present values of these SVVs: all of one source at one boundary.
    pub fn ask(&mut self, names: &[String]) -> Result<Snapshot, Refusals> {
        let mut by_source: BTreeMap<SourceId, Vec<Wanted>> = BTreeMap::new();
        let mut known = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let name = self.name_of(name)?;
            let Some(svv) = self.svvs.get(name) else {
                let named = self.other_cell(name).ok_or_else(|| unknown("SVV", name, self.svvs.keys().map(String::as_str)))?;
                if self.lost.contains(&named.source) {
                    let why = format!("cannot read '{name}': source '{}' is lost", self.source_name(named.source));
                    return Err(refuse(Class::InvalidState, why, "see the log for why, then call reset()"));
                }
                by_source.entry(named.source).or_default().push((index, named.cell, named.stamp));
                continue;
            };
            match svv.home.and_then(|home| Some((home, svv.cells.get(&home)?))) {
                Some((home, _)) if self.lost.contains(&home) => {
                    let why = format!("cannot read SVV '{name}': source '{}', which writes it, is lost", self.source_name(home));
                    return Err(refuse(Class::InvalidState, why, "see the log for why, then call reset()"));
                }
                Some((home, cell)) => {
                    // It is stamped where it is stored, also behind a ratio output.
                    by_source.entry(home).or_default().push((index, cell.clone(), svv.stamps.get(&home).map(|stamp| (stamp.clone(), 1))));
                }
                None => known.push((index, svv.stored.clone(), svv.stored_ns)),
            }
        }
        let sources = by_source.keys().copied().collect();
        let mut asked = Vec::new();
        for (source, cells) in by_source {
            let ticket = self.fresh();
            let layout = cells.iter().map(|(index, cell, stamp)| (*index, cell.len(), stamp.as_ref().map(|(_, ratio)| *ratio))).collect();
            let capture = cells.into_iter().flat_map(|(_, cell, stamp)| std::iter::once(cell).chain(stamp.map(|(stamp, _)| stamp))).collect();
            self.submit(source, vec![Op::Capture(capture)], Purpose::Read { ticket });
            asked.push((ticket, layout));
        }
        Ok(Snapshot { asked, sources, known })
    }

    /// The snapshot, once every kernel has answered: its time, and the readings in the order asked for.
    pub fn snapshot(&mut self, snapshot: &Snapshot, count: usize) -> Option<(i64, Vec<Reading>)> {
        if !snapshot.asked.iter().all(|(ticket, _)| self.reads.contains_key(ticket)) {
            return None;
        }
        let mut readings: Vec<Reading> = vec![Default::default(); count];
        let mut time_ns = if snapshot.asked.is_empty() { self.host.now_ns() } else { 0 };
        for (index, bytes, at) in &snapshot.known {
            readings[*index] = (bytes.clone(), 0, *at);
        }
        for (ticket, layout) in &snapshot.asked {
            let (at, bytes) = self.reads.remove(ticket)?;
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

    /// Why nothing has come from some of its sources: values are taken between invocations.
    pub fn unanswered(&self, snapshot: &Snapshot) -> Refusals {
        let silent = snapshot.asked.iter().zip(&snapshot.sources).find(|((ticket, _), _)| !self.reads.contains_key(ticket));
        let source = silent.map(|(_, source)| *source);
        let runs = source.map(|source| self.blocks_on(source)).unwrap_or_default();
        let runs = if runs.is_empty() { String::new() } else { format!(": {} may be in the middle of an invocation", runs.join(" or ")) };
        let source = source.map_or_else(|| "a kernel".to_owned(), |source| format!("source '{}'", self.source_name(source)));
        refuse(
            Class::InvalidState,
            format!("{source} did not answer{runs}"),
            "a value is read between invocations: read it again later, or its history, which needs none; see statistics() for how long a firing takes",
        )
    }

    /// The active blocks of a source, as they are called in messages.
    fn blocks_on(&self, source: SourceId) -> Vec<String> {
        let mut found = Vec::new();
        for instance in self.instances.values().filter(|instance| instance.state == State::Running) {
            for (activation, _) in instance.active.iter().filter(|(activation, _)| instance.installed.activation_source[*activation] == source) {
                let labels = instance.plan.activations[*activation].blocks.iter().map(|block| &instance.plan.blocks[*block].label);
                found.extend(labels.map(|label| format!("block '{label}' of '{}'", instance.name)));
            }
        }
        found
    }

    /// Nobody waits for the snapshot any more: what comes of it is not kept.
    pub fn forget_snapshot(&mut self, snapshot: &Snapshot) {
        for (ticket, _) in &snapshot.asked {
            self.reads.remove(ticket);
            self.nobody_reads(*ticket);
        }
    }

    /// Stores a value from the PS: refused where an instance has claimed the SVV.
    pub fn write(&mut self, name: &str, value: &Value) -> Result<(), Refusals> {
        let name = self.name_of(name)?;
        let svv = self.svvs.get(name).ok_or_else(|| unknown("SVV", name, self.svvs.keys().map(String::as_str)))?;
        let claim = model::plan::Claim::Svv { id: svv.id, name: name.to_owned() };
        if let Some(holder) = self.claims.get(&claim).and_then(|h| self.instances.get(h)) {
            return Err(refuse(Class::SecondWriter, format!("cannot store into SVV '{name}': it is written by '{}'", holder.name), "wait for it or halt it"));
        }
        let bytes = crate::life::encode(&svv.type_text, &svv.unit, value).map_err(|r| vec![crate::life::named(r, name)])?;
        if let Some((least, most)) = svv.within {
            crate::requirements::within(
                name,
                &model::types::Type::parse(&svv.type_text, &Default::default()).map_err(|r| vec![r])?.decode(&bytes),
                least,
                most,
            )?;
        }
        for (source, ops) in by_source(self.store_everywhere(name, &bytes)) {
            self.submit(source, ops, Purpose::Nothing);
        }
        Ok(())
    }

    /// Up to `count` last values of an SVV with history, oldest first: (number, time, bytes).
    pub fn history(&self, name: &str, count: usize) -> Result<Vec<(u64, i64, Vec<u8>)>, Refusals> {
        let name = self.name_of(name)?;
        let svv = self.svvs.get(name).ok_or_else(|| unknown("SVV", name, self.svvs.keys().map(String::as_str)))?;
        if svv.history == 0 {
            return Err(refuse(Class::ValueRefused, format!("SVV '{name}' has no history"), "declare one: cell.svv(…, history=100)"));
        }
        let mut values = with_stores(written(svv), svv);
        let keep = count.min(svv.history as usize);
        Ok(values.split_off(values.len().saturating_sub(keep)))
    }
}

/// A value with its number and time.
type Past = (u64, i64, Vec<u8>);

/// A value that a block stored: the source, and its row.
type Written = (SourceId, Row);

/// What blocks stored of an SVV, as far as it is kept, oldest first; of one instant, as it went from home to home.
fn written(svv: &SvvRecord) -> Vec<Written> {
    let rows = |(source, ring): (&SourceId, &Arc<RowsEnd>)| ring.reader().last(svv.history as usize).into_iter().map(|row| (*source, row)).collect();
    let mut values: Vec<Written> = svv.rings.iter().flat_map(|of| -> Vec<Written> { rows(of) }).collect();
    if svv.rings.len() > 1 {
        values.sort_by_key(|(source, row)| (row.time_ns, svv.stay(*source, row.sequence), row.sequence));
    }
    values
}

/// The same with what the PS and ψ stored between: such a value has the number of the invocation before it.
fn with_stores(written: Vec<Written>, svv: &SvvRecord) -> Vec<Past> {
    let mut values: Vec<Past> = Vec::with_capacity(written.len() + svv.stores.len());
    let put = |values: &mut Vec<Past>, store: &Stored| values.push((values.last().map_or(0, |(number, ..)| *number), store.time_ns, store.bytes.clone()));
    let mut stores = svv.stores.iter().peekable();
    for (source, row) in written {
        while let Some(store) = stores.next_if(|store| !store.comes_behind(source, &row)) {
            put(&mut values, store);
        }
        values.push((row.number, row.time_ns, row.bytes));
    }
    stores.for_each(|store| put(&mut values, store));
    values
}

fn take<'a>(rest: &mut &'a [u8], len: usize) -> &'a [u8] {
    let (head, tail) = rest.split_at(len.min(rest.len()));
    *rest = tail;
    head
}

/// What the kernel stamps an activation's values with.
pub(crate) struct Stamp {
    pub number: u64,
    pub time_ns: i64,
    pub activated: u64,
}

impl Stamp {
    pub fn of(bytes: &[u8]) -> Stamp {
        let word = |at: usize| bytes.get(at..at + 8).and_then(|b| b.try_into().ok()).map_or(0, u64::from_le_bytes);
        Stamp { number: word(0), time_ns: word(8).cast_signed(), activated: word(16) }
    }

    /// False where no invocation has stored the value.
    pub fn is_set(&self) -> bool {
        self.time_ns != kernel::NEVER_NS
    }

    /// Number of the last invocation that stored a ratio output n: those are n, 2n, … from activation. `None`: there was none.
    pub fn stored(&self, n: u64) -> Option<u64> {
        let since = (self.number + 1).saturating_sub(self.activated);
        (since >= n).then(|| self.number - since % n.max(1))
    }
}
