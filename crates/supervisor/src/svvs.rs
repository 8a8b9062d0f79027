// SPDX-License-Identifier: Apache-2.0
//! State vector variables: one cell in the image of each source that reads or writes it, and who writes it now.
use crate::histories::WindowRecord;
use kernel::{Activation, Cell, Extent, Op, SourceId};
use model::configuration::SvvId;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// An SVV of the system. Its value belongs to it, not to a writer.
pub(crate) struct SvvRecord {
    pub id: SvvId,
    pub type_text: String,
    pub unit: String,
    pub size: usize,
    /// Least and greatest value that the PS may store.
    pub within: Option<(f64, f64)>,
    /// How many earlier values Python may ask for.
    pub history: u32,
    /// Where it lies in each image.
    pub cells: BTreeMap<SourceId, Cell>,
    /// Sources with a block that reads it, counted.
    pub readers: BTreeMap<SourceId, usize>,
    /// The source whose cell holds the present value; `None` while only the PS has stored it.
    pub home: Option<SourceId>,
    /// The value that the PS stored last, present while there is no home.
    pub stored: Vec<u8>,
    /// The time of `stored`, ns.
    pub stored_ns: i64,
    /// Ports that may write it: instance, activation, source.
    pub writers: Vec<WriterRecord>,
    /// Instances with a port bound to it.
    pub bound: usize,
    /// Number and time of its last value: of who wrote it last.
    pub stamp: Option<Cell>,
    /// n where its present writer's port is a ratio output n, else 1.
    pub ratio: u64,
    /// The most firings of its home from one value to the next, of the writers so far.
    pub firings: usize,
    /// Values that earlier rows held, oldest first: (number, time, bytes).
    pub past: Vec<(u64, i64, Vec<u8>)>,
    /// Where its history comes from: the reader of its home's rows, and its offset in a row.
    pub rows: Option<(interconnect::RowsReader, usize)>,
    /// The windows of its last values that blocks read.
    pub windows: Vec<WindowRecord>,
    /// What the PS and ψ stored last, oldest first, as far as its history reaches: (time, bytes).
    pub stores: VecDeque<(i64, Vec<u8>)>,
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
    /// The cell of this SVV in the image of `source`; made with the stored value where there was none.
    pub fn cell(&mut self, source: SourceId) -> Cell {
        if let Some(cell) = self.cells.get(&source) {
            return cell.clone();
        }
        let cell = Extent::new(self.size.max(1)).cell(0, self.size);
        cell.store(&self.stored);
        self.cells.insert(source, cell.clone());
        cell
    }

    /// A value that no block wrote: it is the present one for images that get the SVV later, and part of its history.
    pub fn keep(&mut self, bytes: &[u8], now_ns: i64) {
        self.stored = bytes.to_vec();
        self.stored_ns = now_ns;
        if self.history > 0 {
            self.stores.push_back((now_ns, bytes.to_vec()));
            let excess = self.stores.len().saturating_sub(self.history as usize);
            self.stores.drain(..excess);
        }
    }

    /// Operations that put the value that is known into the image of a source that has lost its own; nothing where another source has it.
    pub fn known_ops(&self, source: SourceId) -> Vec<Op> {
        match self.cells.get(&source) {
            Some(cell) if self.home.is_none_or(|home| home == source) => vec![Op::Store(cell.clone(), self.stored.as_slice().into())],
            _ => Vec::new(),
        }
    }

    /// Operations that store a value in every image that has the SVV, and in its windows.
    pub fn store_ops(&self, bytes: &[u8]) -> Vec<(SourceId, Op)> {
        let stores = self.cells.iter().map(|(source, cell)| (*source, Op::Store(cell.clone(), bytes.into())));
        stores.chain(self.append_ops()).collect()
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
        cell.store(&svv.stored);
        svv.cells.insert(source, cell);
    }
}
