// SPDX-License-Identifier: Apache-2.0
//! State vector variables: one cell in the image of each source that reads or writes the SVV, and its current writer.
use kernel::{Activation, BlockId, Cell, Extent, Op, RowsEnd, STAMP_LEN, SourceId, Window, unstamped};
use model::configuration::SvvId;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// An SVV of the system. It has a value even if it has no writer.
pub(crate) struct SvvRecord {
    pub id: SvvId,
    pub type_text: String,
    pub unit: String,
    pub size: usize,
    /// Initial value. If it is 0 and the SVV commands a device, 0 is its idle value.
    pub first: Vec<u8>,
    /// Range of the values that the PS may store.
    pub within: Option<model::range::Range>,
    /// Cell of the SVV in each image.
    pub cells: BTreeMap<SourceId, Cell>,
    /// Sources with blocks that read the SVV, each with the number of readers.
    pub readers: BTreeMap<SourceId, usize>,
    /// Source whose cell contains the current value; `None` as long as only the PS has stored the value.
    pub home: Option<SourceId>,
    /// Ports that may write the SVV: instance, activation, source.
    pub writers: Vec<WriterRecord>,
    /// Block that is currently writing the SVV or was the last to write it.
    pub written_by: Option<BlockId>,
    /// Number of instances that have a port bound to the SVV.
    pub bound: usize,
    /// Number and time of the most recent value, in the image of each source that may write the SVV.
    pub stamps: BTreeMap<SourceId, Cell>,
    /// n if the current writer's port is a ratio output n, otherwise 1.
    pub ratio: u64,
    /// Windows of the SVV's most recent values that blocks read.
    pub windows: Vec<WindowRecord>,
    pub past: Past,
}

/// Earlier values of an SVV.
#[derive(Default)]
pub(crate) struct Past {
    /// Number of earlier values available to Python.
    pub history: u32,
    /// Value that the PS most recently stored, used as long as there is no home.
    pub stored: Vec<u8>,
    /// Time of `stored`, ns.
    pub stored_ns: i64,
    /// Rings of the history: the most recent values stored by blocks, for each source that has such blocks.
    pub rings: BTreeMap<SourceId, Arc<RowsEnd>>,
    /// Homes of the SVV, oldest first, as far back as the history may reach: the source, and the number of rows that its ring contained
    /// when it became the home.
    pub stays: Arc<Stays>,
    /// Most recent values stored by the PS and ψ, oldest first, as far back as the history reaches.
    pub stores: Arc<VecDeque<StoredValue>>,
}

/// Window of the most recent values of an SVV that some block reads.
pub(crate) struct WindowRecord {
    /// Number of values.
    pub count: u32,
    /// Window in each image.
    pub cells: BTreeMap<SourceId, Window>,
    /// Sources with blocks that read the window, each with the number of readers.
    pub readers: BTreeMap<SourceId, usize>,
    /// True if the window has received its initial values.
    pub begun: bool,
}

/// Homes of an SVV, oldest first: the source, and the number of rows that its ring contained when it became the home.
#[derive(Clone, Default)]
pub(crate) struct Stays(VecDeque<(SourceId, u64)>);

impl Stays {
    /// Returns the index of the home during which a row was written.
    pub fn of(&self, source: SourceId, row: u64) -> usize {
        self.0.iter().rposition(|(home, from)| *home == source && *from <= row).map_or(0, |stay| stay + 1)
    }
}

/// A value that was not stored by a block.
#[derive(Clone)]
pub(crate) struct StoredValue {
    pub time_ns: i64,
    pub bytes: Vec<u8>,
    /// Home at the time of the store, and the number of rows in its ring. These rows precede the value, even if they have the same time.
    pub behind: Option<(SourceId, u64)>,
}

impl StoredValue {
    /// Returns true if the row precedes the value.
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
    /// n for a ratio output n, otherwise 1.
    pub ratio: u32,
}

impl SvvRecord {
    /// Returns the cell of this SVV in the image of `source`, creating it with the stored value if necessary.
    pub fn cell(&mut self, source: SourceId) -> Cell {
        if let Some(cell) = self.cells.get(&source) {
            return cell.clone();
        }
        let cell = Extent::new(self.size.max(1)).cell(0, self.size);
        cell.store(&self.past.stored);
        self.cells.insert(source, cell.clone());
        cell
    }

    /// Keeps a value that was not written by a block, as the current value for images to which the SVV is added later, and as part of its
    /// history.
    pub fn keep(&mut self, bytes: &[u8], now_ns: i64) {
        self.past.stored = bytes.to_vec();
        self.past.stored_ns = now_ns;
        if self.past.history > 0 {
            let behind = self.home.and_then(|home| Some((home, self.past.rings.get(&home)?.reader().written())));
            // This copies only while a reader holds the history.
            let stores = Arc::make_mut(&mut self.past.stores);
            stores.push_back(StoredValue { time_ns: now_ns, bytes: bytes.to_vec(), behind });
            let excess = stores.len().saturating_sub(self.past.history as usize);
            stores.drain(..excess);
        }
    }

    /// Moves the home of the SVV to another source.
    pub fn comes_to(&mut self, source: SourceId) {
        if let Some(ring) = self.past.rings.get(&source) {
            let written = ring.reader().written();
            let stays = &mut Arc::make_mut(&mut self.past.stays).0;
            stays.push_back((source, written));
            let excess = stays.len().saturating_sub(self.past.history as usize + 1);
            stays.drain(..excess);
        }
    }

    /// Returns the operations that restore the last known value in the image of a source that has lost its image; empty if another source
    /// is the home.
    pub fn known_ops(&self, source: SourceId) -> Vec<Op> {
        match self.cells.get(&source) {
            Some(cell) if self.home.is_none_or(|home| home == source) => vec![Op::Store(cell.clone(), self.past.stored.as_slice().into())],
            _ => Vec::new(),
        }
    }

    /// Returns the operations that store a value in every image that contains the SVV, and in its windows.
    pub fn store_ops(&self, bytes: &[u8]) -> Vec<(SourceId, Op)> {
        let stores = self.cells.iter().map(|(source, cell)| (*source, Op::Store(cell.clone(), bytes.into())));
        stores.chain(self.append_ops()).collect()
    }
}

/// Number of rows kept in addition to the requested history, so that a reader that is copying is not overtaken.
pub(crate) const ROWS_SPARE: usize = 64;

/// Creates the missing stamps of the SVVs that blocks of `source` may write, contiguously.
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

/// Creates the cells of several SVVs in one image contiguously if none of them exists yet, so that an array port bound to them needs no
/// gather step.
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
