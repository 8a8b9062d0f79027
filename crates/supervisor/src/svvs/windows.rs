// SPDX-License-Identifier: Apache-2.0
//! Windows: the most recent values of SVVs and private cells, for blocks with history inputs.
//!
//! There is one window for each SVV and number of values that some block reads. It exists in the image of each source that writes or
//! reads it. The source that is the SVV's home appends to the window in its own image; the others receive it together with the value, in
//! the asynchronous group of the pair. A window is created with the first instance that reads it, with all entries set to the current
//! value, and deleted with the last.
use crate::claims::writers::Pair;
use crate::svvs::cells::{SvvRecord, WindowRecord};
use kernel::{Cell, Extent, Op, SourceId, Window};
use model::plan::{Binding, Plan};
use std::collections::BTreeMap;

/// Returns the windows that a plan's blocks read: (cell, number of values) → sources of the blocks.
pub(crate) fn asked(plan: &Plan, block_source: &[SourceId]) -> BTreeMap<(usize, u32), Vec<SourceId>> {
    let mut asked: BTreeMap<(usize, u32), Vec<SourceId>> = BTreeMap::new();
    for (index, block) in plan.blocks.iter().enumerate() {
        for bound in block.bindings.iter().filter(|bound| bound.history > 0) {
            if let Binding::Cell(cell) = bound.binding {
                asked.entry((cell, bound.history)).or_default().push(block_source[index]);
            }
        }
    }
    asked
}

pub(crate) fn window(size: usize, count: u32, value: &[u8]) -> Window {
    let len = size * count as usize;
    let window = Window::new(Extent::new(len).cell(0, len), size);
    window.fill(value);
    window
}

impl SvvRecord {
    /// Returns the window of `count` values in the image of `source`, creating it with the stored value if necessary.
    pub fn window(&mut self, count: u32, source: SourceId) -> Window {
        let at = self.windows.iter().position(|window| window.count == count).unwrap_or_else(|| {
            self.windows.push(WindowRecord { count, cells: BTreeMap::new(), readers: BTreeMap::new(), begun: false });
            self.windows.len() - 1
        });
        self.cell(source);
        let (size, stored) = (self.size, &self.past.stored);
        self.windows[at].cells.entry(source).or_insert_with(|| window(size, count, stored)).clone()
    }

    /// Counts the readers of the windows of a plan's cell `cell`. Returns the pairs whose connections change.
    pub fn count_windows(&mut self, plan: &Plan, cell: usize, block_source: &[SourceId]) -> Vec<Pair> {
        let mut pairs = Vec::new();
        if self.windows.is_empty() {
            return pairs;
        }
        for ((_, count), sources) in asked(plan, block_source).into_iter().filter(|((of, _), _)| *of == cell) {
            for source in sources {
                let Some(window) = self.windows.iter_mut().find(|window| window.count == count) else { continue };
                let readers = window.readers.entry(source).or_default();
                *readers += 1;
                pairs.extend(self.home.filter(|home| *readers == 1 && *home != source).map(|home| (home, source)));
            }
        }
        pairs
    }

    /// Removes the readers of windows; a window without readers is deleted.
    pub fn discount_windows(&mut self, plan: &Plan, cell: usize, block_source: &[SourceId]) -> Vec<Pair> {
        let mut pairs = Vec::new();
        if self.windows.is_empty() {
            return pairs;
        }
        for ((_, count), sources) in asked(plan, block_source).into_iter().filter(|((of, _), _)| *of == cell) {
            for source in sources {
                let Some(readers) = self.windows.iter_mut().find(|window| window.count == count).and_then(|window| window.readers.get_mut(&source)) else {
                    continue;
                };
                *readers -= 1;
                pairs.extend(self.home.filter(|home| *readers == 0 && *home != source).map(|home| (home, source)));
            }
        }
        self.windows.retain(|window| window.readers.values().any(|readers| *readers > 0));
        pairs
    }

    /// Returns the operations that append a stored value to the windows: in the home, from which it propagates, or in every image if
    /// there is no home.
    pub fn append_ops(&self) -> Vec<(SourceId, Op)> {
        let of = |window: &WindowRecord| -> Vec<(SourceId, Op)> {
            let images = window.cells.iter().filter(|(source, _)| self.home.is_none_or(|home| home == **source));
            images.filter_map(|(source, window)| Some((*source, Op::Append { value: self.cells.get(source)?.clone(), window: window.clone() }))).collect()
        };
        self.windows.iter().flat_map(of).collect()
    }

    /// Returns the windows that are sent from one source to another, as (cell in `from`, cell in `to`).
    pub fn crossing_windows(&self, from: SourceId, to: SourceId) -> impl Iterator<Item = (Cell, Cell)> + '_ {
        let read = self.windows.iter().filter(move |window| window.readers.get(&to).is_some_and(|readers| *readers > 0));
        read.filter_map(move |window| Some((window.cells.get(&from)?.cell().clone(), window.cells.get(&to)?.cell().clone())))
    }

    /// Returns the windows that move to another source together with their SVV, as (cell in `from`, cell in `to`).
    pub fn carried_windows(&self, from: SourceId, to: SourceId) -> impl Iterator<Item = (Cell, Cell)> + '_ {
        self.windows.iter().filter_map(move |window| Some((window.cells.get(&from)?.cell().clone(), window.cells.get(&to)?.cell().clone())))
    }
}
