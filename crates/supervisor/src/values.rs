// SPDX-License-Identifier: Apache-2.0
//! Values of SVVs: snapshots, stores, histories.
use crate::core::{Core, Purpose};
use crate::refuse::{refuse, unknown};
use crate::sequence::by_source;
use crate::svvs::SvvRecord;
use kernel::connection::RowsEnd;
use kernel::{Cell, Op, SourceId};
use model::refusal::{Class, Refusals};
use model::value::Value;
use std::collections::BTreeMap;

/// Rows kept beyond what a history asks for, so that a reader is not overtaken while it copies.
const ROWS_SPARE: usize = 64;

/// Index of an SVV in a snapshot, its bytes, and where a stamp follows, n of its writer's ratio output.
type Asked = (usize, usize, Option<u64>);

/// Index of an SVV in a snapshot, its cell, and its stamp with n of its writer's ratio output.
type Wanted = (usize, Cell, Option<(Cell, u64)>);

/// How the values of a port that writes an SVV are stamped and how often they come.
pub(crate) struct Stamped {
    pub stamp: Cell,
    /// n of a ratio output n, else 1.
    pub ratio: u64,
    /// The most firings of its source from one value to the next.
    pub firings: usize,
}

/// A snapshot that is under way.
pub(crate) struct Snapshot {
    /// For each source that was asked: the ticket, and what was asked for.
    pub asked: Vec<(u64, Vec<Asked>)>,
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
                    by_source.entry(home).or_default().push((index, cell.clone(), svv.stamp.clone().map(|stamp| (stamp, svv.ratio))));
                }
                None => known.push((index, svv.stored.clone(), svv.stored_ns)),
            }
        }
        let mut asked = Vec::new();
        for (source, cells) in by_source {
            let ticket = self.fresh();
            let layout = cells.iter().map(|(index, cell, stamp)| (*index, cell.len(), stamp.as_ref().map(|(_, ratio)| *ratio))).collect();
            let capture = cells.into_iter().flat_map(|(_, cell, stamp)| std::iter::once(cell).chain(stamp.map(|(stamp, _)| stamp))).collect();
            self.submit(source, vec![Op::Capture(capture)], Purpose::Read { ticket });
            asked.push((ticket, layout));
        }
        Ok(Snapshot { asked, known })
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
                    (stamp.stored(ratio).unwrap_or(0), stamp.time_ns)
                });
                readings[*index] = (value.to_vec(), number, stamp_ns);
            }
        }
        Some((time_ns, readings))
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

    /// Makes the rows of the sources in which an SVV with history has got its home, or has been made.
    pub fn remake_rows(&mut self, written: &[(String, SourceId)], stamps: Vec<Stamped>) -> Vec<SourceId> {
        let mut sources = Vec::new();
        for ((name, source), Stamped { stamp, ratio, firings }) in written.iter().zip(stamps) {
            let svv = self.svvs.get_mut(name).expect("the plan was made from the SVVs that exist");
            let same = svv.stamp.replace(stamp.clone()).is_some_and(|before| before.is_same(&stamp));
            svv.ratio = ratio;
            svv.firings = svv.firings.max(firings);
            if svv.history > 0 && !(same && svv.rows.is_some()) {
                sources.push(*source);
            }
        }
        sources.sort();
        sources.dedup();
        for &source in &sources {
            self.remake_rows_of(source);
        }
        sources
    }

    /// Makes the rows deeper where these SVVs come less often than before: (SVV, firings from one value to the next). The sources whose
    /// tables change.
    pub fn deepen_rows(&mut self, written: &[(String, usize)]) -> Vec<SourceId> {
        let mut sources = Vec::new();
        for (name, firings) in written {
            let Some(svv) = self.svvs.get_mut(name).filter(|svv| svv.history > 0 && svv.firings < *firings) else { continue };
            svv.firings = *firings;
            sources.extend(svv.home.filter(|_| svv.rows.is_some()));
        }
        sources.sort();
        sources.dedup();
        sources.iter().for_each(|source| self.remake_rows_of(*source));
        sources
    }

    /// Rows of one source: for each SVV with history its stamp and its value.
    fn remake_rows_of(&mut self, source: SourceId) {
        let mut cells = Vec::new();
        let mut offsets = Vec::new();
        let (mut len, mut depth) = (0, 0);
        for (name, svv) in &self.svvs {
            let Some(stamp) = &svv.stamp else { continue };
            if svv.history == 0 || svv.home != Some(source) {
                continue;
            }
            offsets.push((name.clone(), len));
            let cell = svv.cells[&source].clone();
            len += stamp.len() + cell.len();
            cells.push(stamp.clone());
            cells.push(cell);
            depth = depth.max(svv.history as usize * svv.firings);
        }
        let (writer, reader) = interconnect::rows(len, depth + ROWS_SPARE);
        if let Some(table) = self.tables.get_mut(&source) {
            table.rows = Some((cells, RowsEnd::new(writer)));
        }
        for (name, offset) in offsets {
            // What the rows before held is history all the same.
            let past = self.svvs.get(&name).map(written).unwrap_or_default();
            if let Some(svv) = self.svvs.get_mut(&name) {
                svv.past = past;
                svv.rows = Some((reader.clone(), offset));
            }
        }
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

/// What blocks wrote of an SVV, as far as it is kept, oldest first.
fn written(svv: &SvvRecord) -> Vec<Past> {
    let mut values = svv.past.clone();
    let Some((reader, offset)) = &svv.rows else { return values };
    for row in reader.last(usize::MAX) {
        let mut rest = &row.bytes[*offset..];
        let stamp = Stamp::of(take(&mut rest, kernel::STAMP_LEN));
        let (number, time_ns) = (stamp.number, stamp.time_ns);
        let same = values.last().is_some_and(|(n, t, _)| (*n, *t) == (number, time_ns));
        if time_ns > 0 && !same && stamp.stored(svv.ratio) == Some(number) {
            values.push((number, time_ns, take(&mut rest, svv.size).to_vec()));
        }
    }
    values
}

/// The same with what the PS and ψ stored between: such a value has the number of the invocation before it.
fn with_stores(written: Vec<Past>, svv: &SvvRecord) -> Vec<Past> {
    let mut values: Vec<Past> = Vec::with_capacity(written.len() + svv.stores.len());
    let mut stores = svv.stores.iter().peekable();
    for value in written {
        while let Some((time_ns, bytes)) = stores.next_if(|(time_ns, _)| *time_ns < value.1) {
            values.push((values.last().map_or(0, |(number, _, _)| *number), *time_ns, bytes.clone()));
        }
        values.push(value);
    }
    for (time_ns, bytes) in stores {
        values.push((values.last().map_or(0, |(number, _, _)| *number), *time_ns, bytes.clone()));
    }
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

    /// Number of the last invocation that stored a ratio output n: those are n, 2n, … from activation. `None`: there was none.
    pub fn stored(&self, n: u64) -> Option<u64> {
        let since = (self.number + 1).saturating_sub(self.activated);
        (since >= n).then(|| self.number - since % n.max(1))
    }
}
