// SPDX-License-Identifier: Apache-2.0
//! State vector variables: one cell in the image of each source that reads or writes it, and who writes it now.
use kernel::{Activation, BlockId, Cell, Extent, Op, RowsEnd, STAMP_LEN, SourceId, Window, unstamped};
use model::configuration::SvvId;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// An SVV of the system. Its value belongs to it, not to a writer.
pub(crate) struct SvvRecord {
    pub id: SvvId,
    pub type_text: String,
    pub unit: String,
    pub size: usize,
    /// The value that it began with. Where that is 0 and it commands a device, 0 is its idle value.
    pub first: Vec<u8>,
    /// Minimum and maximum value that the PS may store.
    pub within: Option<model::range::Range>,
    /// Its cell in each image.
    pub cells: BTreeMap<SourceId, Cell>,
    /// Sources with a block that reads it, counted.
    pub readers: BTreeMap<SourceId, usize>,
    /// The source whose cell holds the present value; `None` while only the PS has stored it.
    pub home: Option<SourceId>,
    /// Ports that may write it: instance, activation, source.
    pub writers: Vec<WriterRecord>,
    /// The block that writes it now, or wrote it last.
    pub written_by: Option<BlockId>,
    /// Instances with a port bound to it.
    pub bound: usize,
    /// Number and time of its last value, in the image of each source that may write it.
    pub stamps: BTreeMap<SourceId, Cell>,
    /// n where its present writer's port is a ratio output n, else 1.
    pub ratio: u64,
    /// The windows of its last values that blocks read.
    pub windows: Vec<WindowRecord>,
    pub past: Past,
}

/// Earlier values of an SVV.
#[derive(Default)]
pub(crate) struct Past {
    /// Number of earlier values that Python may ask for.
    pub history: u32,
    /// The value that the PS stored last, present while there is no home.
    pub stored: Vec<u8>,
    /// The time of `stored`, ns.
    pub stored_ns: i64,
    /// Rings of its history: the last values that blocks of each such source stored.
    pub rings: BTreeMap<SourceId, Arc<RowsEnd>>,
    /// Where it had its homes, oldest first, as far as its history may reach: the source, and the rows that its ring had then.
    pub stays: Arc<Stays>,
    /// Values that the PS and ψ stored last, oldest first, as far as its history reaches.
    pub stores: Arc<VecDeque<StoredValue>>,
}

/// The last values of an SVV that some block reads.
pub(crate) struct WindowRecord {
    /// Number of values.
    pub count: u32,
    /// Its window in each image.
    pub cells: BTreeMap<SourceId, Window>,
    /// Sources with a block that reads it, counted.
    pub readers: BTreeMap<SourceId, usize>,
    /// True if it has had its first values.
    pub begun: bool,
}

/// Where an SVV had its homes, oldest first: the source, and the rows that its ring had then.
#[derive(Clone, Default)]
pub(crate) struct Stays(VecDeque<(SourceId, u64)>);

impl Stays {
    /// Returns the index of the one in which a row was written.
    pub fn of(&self, source: SourceId, row: u64) -> usize {
        self.0.iter().rposition(|(home, from)| *home == source && *from <= row).map_or(0, |stay| stay + 1)
    }
}

/// A value that no block stored.
#[derive(Clone)]
pub(crate) struct StoredValue {
    pub time_ns: i64,
    pub bytes: Vec<u8>,
    /// Rows that its home's ring had then: those come before it, also of the same instant.
    pub behind: Option<(SourceId, u64)>,
}

impl StoredValue {
    /// Returns true if the row was written before.
    pub fn comes_behind(&self, source: SourceId, row: &interconnect::Row) -> bool {
        row.time_ns < self.time_ns || (row.time_ns == self.time_ns && self.behind.is_some_and(|(home, written)| home == source && row.sequence < written))
    }
}

/// A port that may write an SVV.
#[derive(Clone)]
pub(crate) struct WriterRecord {
    pub instance: u64,
    pub source: SourceId,
    pub activation: Arc<Activation>,
    pub block: kernel::BlockId,
    /// n of a ratio output n, else 1.
    pub ratio: u32,
}

impl SvvRecord {
    /// Returns the cell of this SVV in the image of `source`; made with the stored value if there was none.
    pub fn cell(&mut self, source: SourceId) -> Cell {
        if let Some(cell) = self.cells.get(&source) {
            return cell.clone();
        }
        let cell = Extent::new(self.size.max(1)).cell(0, self.size);
        cell.store(&self.past.stored);
        self.cells.insert(source, cell.clone());
        cell
    }

    /// Keeps a value that no block wrote: it is the present one for images that get the SVV later, and part of its history.
    pub fn keep(&mut self, bytes: &[u8], now_ns: i64) {
        self.past.stored = bytes.to_vec();
        self.past.stored_ns = now_ns;
        if self.past.history > 0 {
            let behind = self.home.and_then(|home| Some((home, self.past.rings.get(&home)?.reader().written())));
            // A copy is made only while a reader holds the history.
            let stores = Arc::make_mut(&mut self.past.stores);
            stores.push_back(StoredValue { time_ns: now_ns, bytes: bytes.to_vec(), behind });
            let excess = stores.len().saturating_sub(self.past.history as usize);
            stores.drain(..excess);
        }
    }

    /// Moves its home to another source.
    pub fn comes_to(&mut self, source: SourceId) {
        if let Some(ring) = self.past.rings.get(&source) {
            let written = ring.reader().written();
            let stays = &mut Arc::make_mut(&mut self.past.stays).0;
            stays.push_back((source, written));
            let excess = stays.len().saturating_sub(self.past.history as usize + 1);
            stays.drain(..excess);
        }
    }

    /// Operations that put the value that is known into the image of a source that has lost its own; nothing where another source has it.
    pub fn known_ops(&self, source: SourceId) -> Vec<Op> {
        match self.cells.get(&source) {
            Some(cell) if self.home.is_none_or(|home| home == source) => vec![Op::Store(cell.clone(), self.past.stored.as_slice().into())],
            _ => Vec::new(),
        }
    }

    /// Operations that store a value in every image that has the SVV, and in its windows.
    pub fn store_ops(&self, bytes: &[u8]) -> Vec<(SourceId, Op)> {
        let stores = self.cells.iter().map(|(source, cell)| (*source, Op::Store(cell.clone(), bytes.into())));
        stores.chain(self.append_ops()).collect()
    }
}

/// Rows kept beyond what a history asks for, so that a reader is not overtaken while it copies.
pub(crate) const ROWS_SPARE: usize = 64;

/// Makes what the SVVs that blocks of `source` may write have there beside their value, where it is not there yet: the stamps side by side.
pub(crate) fn make_stamps<'a>(svvs: impl IntoIterator<Item = &'a mut SvvRecord>, source: SourceId) {
    let mut new: Vec<&mut SvvRecord> = svvs.into_iter().filter(|svv| !svv.stamps.contains_key(&source)).collect();
    let extent = Extent::new((STAMP_LEN * new.len()).max(1));
    for (index, svv) in new.iter_mut().enumerate() {
        let stamp = extent.cell(index * STAMP_LEN, STAMP_LEN);
        stamp.store(&unstamped());
        svv.stamps.insert(source, stamp);
        if svv.past.history > 0 {
            let (writer, _) = interconnect::rows(svv.size, svv.past.history as usize + ROWS_SPARE);
            svv.past.rings.insert(source, RowsEnd::new(writer));
        }
    }
}

/// Makes the cells of several SVVs in one image side by side, where none of them is there yet: an array port bound to them then
/// needs no gather.
pub(crate) fn lay_side_by_side(svvs: &mut [&mut SvvRecord], source: SourceId) {
    let size = svvs.first().map_or(0, |s| s.size);
    if size == 0 || svvs.iter().any(|s| s.size != size || s.cells.contains_key(&source)) {
        return;
    }
    let extent = Extent::new(size * svvs.len());
    for (index, svv) in svvs.iter_mut().enumerate() {
        let cell = extent.cell(index * size, size);
        cell.store(&svv.past.stored);
        svv.cells.insert(source, cell);
    }
}
