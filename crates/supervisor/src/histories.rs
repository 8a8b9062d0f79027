// SPDX-License-Identifier: Apache-2.0
//! Windows: the last values of SVVs and private cells, for blocks with history inputs.
//!
//! There is one window for each SVV and number of values that some block reads; it lies in the image of each source that writes or reads
//! it. The source that is the SVV's home appends to its own; the others get it with the value, in the asynchronous group of the
//! pair. It begins when the first instance that reads it is created, all entries being the present value, and ends with the last.
use crate::connect::Pair;
use crate::core::Core;
use crate::install::Installed;
use crate::instance::Instance;
use crate::sequence::by_source;
use crate::svvs::SvvRecord;
use kernel::{Append, Cell, Extent, Op, SourceId, Window};
use model::interface::Mode;
use model::plan::{Binding, CellKind, Plan};
use std::collections::BTreeMap;

/// The windows that the blocks of an instance read: (planned cell, number of values) → in each image.
pub(crate) type Windows = BTreeMap<(usize, u32), BTreeMap<SourceId, Window>>;

/// Scripts for sources.
type Scripts = Vec<(SourceId, Vec<Op>)>;

/// The last values of an SVV that some block reads.
pub(crate) struct WindowRecord {
    /// How many values.
    pub count: u32,
    /// Where it lies in each image.
    pub cells: BTreeMap<SourceId, Window>,
    /// Sources with a block that reads it, counted.
    pub readers: BTreeMap<SourceId, usize>,
    /// It has had its first values.
    begun: bool,
}

/// What a plan's blocks read of a cell's history: (cell, number of values) → sources of the blocks.
fn asked(plan: &Plan, block_source: &[SourceId]) -> BTreeMap<(usize, u32), Vec<SourceId>> {
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

/// Makes the windows that a plan needs: of private cells in memory of their own, of SVVs where they lie. An SVV that the plan writes
/// gets its windows in the writer's image too.
pub(crate) fn make_windows(core: &mut Core, plan: &Plan, block_source: &[SourceId], cells: &[BTreeMap<SourceId, Cell>]) -> Windows {
    let mut windows = Windows::new();
    for ((cell, count), mut sources) in asked(plan, block_source) {
        let planned = &plan.cells[cell];
        sources.extend(planned.writers.iter().map(|(block, _)| block_source[*block]));
        let of = match &planned.kind {
            CellKind::Svv { name, .. } => {
                let svv = core.svvs.get_mut(name).expect("the plan was made from the SVVs that exist");
                sources.extend(svv.writers.iter().map(|writer| writer.source).chain(svv.home));
                sources.into_iter().map(|source| (source, svv.window(count, source))).collect()
            }
            _ => sources
                .into_iter()
                .filter(|source| cells[cell].contains_key(source))
                .map(|source| (source, window(planned.size, count, &planned.initial)))
                .collect(),
        };
        windows.insert((cell, count), of);
    }
    for cell in &plan.cells {
        let CellKind::Svv { name, .. } = &cell.kind else { continue };
        let Some(svv) = core.svvs.get_mut(name) else { continue };
        for (block, _) in &cell.writers {
            let counts: Vec<u32> = svv.windows.iter().map(|window| window.count).collect();
            for count in counts {
                svv.window(count, block_source[*block]);
            }
        }
    }
    windows
}

fn window(size: usize, count: u32, value: &[u8]) -> Window {
    let len = size * count as usize;
    let window = Window::new(Extent::new(len).cell(0, len), size);
    window.fill(value);
    window
}

impl SvvRecord {
    /// The window of this many values in the image of `source`; made with the stored value where there was none.
    fn window(&mut self, count: u32, source: SourceId) -> Window {
        let at = self.windows.iter().position(|window| window.count == count).unwrap_or_else(|| {
            self.windows.push(WindowRecord { count, cells: BTreeMap::new(), readers: BTreeMap::new(), begun: false });
            self.windows.len() - 1
        });
        self.cell(source);
        let (size, stored) = (self.size, &self.stored);
        self.windows[at].cells.entry(source).or_insert_with(|| window(size, count, stored)).clone()
    }

    /// Counts the readers of its windows that cell `cell` of a plan has. The pairs whose connections change.
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

    /// The opposite; a window without a reader is given up.
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

    /// Operations that append what was stored to its windows: at its home, whence it travels, or where it has none in every image.
    pub fn append_ops(&self) -> Vec<(SourceId, Op)> {
        let of = |window: &WindowRecord| -> Vec<(SourceId, Op)> {
            let images = window.cells.iter().filter(|(source, _)| self.home.is_none_or(|home| home == **source));
            images.filter_map(|(source, window)| Some((*source, Op::Append { value: self.cells.get(source)?.clone(), window: window.clone() }))).collect()
        };
        self.windows.iter().flat_map(of).collect()
    }

    /// Windows that travel from one source to another: (cell there, cell here).
    pub fn crossing_windows(&self, from: SourceId, to: SourceId) -> impl Iterator<Item = (Cell, Cell)> + '_ {
        let read = self.windows.iter().filter(move |window| window.readers.get(&to).is_some_and(|readers| *readers > 0));
        read.filter_map(move |window| Some((window.cells.get(&from)?.cell().clone(), window.cells.get(&to)?.cell().clone())))
    }

    /// Windows that go to another source with their SVV: (cell there, cell here).
    pub fn carried_windows(&self, from: SourceId, to: SourceId) -> impl Iterator<Item = (Cell, Cell)> + '_ {
        self.windows.iter().filter_map(move |window| Some((window.cells.get(&from)?.cell().clone(), window.cells.get(&to)?.cell().clone())))
    }
}

impl Installed {
    /// Windows of a private cell that travel between two sources.
    pub fn crossing_windows(&self, cell: usize, from: SourceId, to: SourceId) -> impl Iterator<Item = (Cell, Cell)> + '_ {
        let of = self.windows.range((cell, 0)..=(cell, u32::MAX));
        of.filter_map(move |(_, windows)| Some((windows.get(&from)?.cell().clone(), windows.get(&to)?.cell().clone())))
    }
}

impl Instance {
    /// At a start: every value of the windows of private cells is the cell's first one.
    pub fn fill_ops(&self) -> Vec<(SourceId, Op)> {
        let mut ops = Vec::new();
        for ((cell, _), windows) in &self.installed.windows {
            if !matches!(self.plan.cells[*cell].kind, CellKind::Svv { .. }) {
                let fill = |(source, window): (&SourceId, &Window)| {
                    Some((*source, Op::Fill { value: self.installed.cell(*cell, *source)?.clone(), window: window.clone() }))
                };
                ops.extend(windows.iter().filter_map(fill));
            }
        }
        ops
    }

    /// Operations that append what ψ stored in a private cell to its windows: where it is written, or where nothing writes it in every image.
    pub fn append_ops(&self, cell: usize) -> Vec<(SourceId, Op)> {
        let writer = self.installed.home(&self.plan, cell).filter(|_| !self.plan.cells[cell].writers.is_empty());
        let windows = self.installed.windows.range((cell, 0)..=(cell, u32::MAX)).flat_map(|(_, windows)| windows);
        let images = windows.filter(|(source, _)| writer.is_none_or(|writer| writer == **source));
        images
            .filter_map(|(source, window)| Some((*source, Op::Append { value: self.installed.cell(cell, *source)?.clone(), window: window.clone() })))
            .collect()
    }

    /// Windows that what block `block` stores is appended to.
    fn appends(&self, block: usize, svvs: &indexmap::IndexMap<String, SvvRecord>) -> Vec<Append> {
        let (installed, source) = (&self.installed, self.installed.block_source[block]);
        let mut appends = Vec::new();
        for (index, cell) in self.plan.cells.iter().enumerate() {
            for (_, item) in cell.writers.iter().filter(|(writer, _)| *writer == block) {
                let windows: Vec<&Window> = match &cell.kind {
                    CellKind::Svv { name, .. } => {
                        svvs.get(name).into_iter().flat_map(|svv| &svv.windows).filter_map(|window| window.cells.get(&source)).collect()
                    }
                    _ => installed.windows.range((index, 0)..=(index, u32::MAX)).filter_map(|(_, windows)| windows.get(&source)).collect(),
                };
                let Some(value) = installed.cell(index, source) else { continue };
                let ratio = if let Mode::Ratio(n) = installed.interfaces[block].items[*item].mode { n } else { 1 };
                let append = |window: &Window| Append { block: installed.blocks[block].clone(), ratio, value: value.clone(), window: window.clone() };
                appends.extend(windows.into_iter().map(append));
            }
        }
        appends
    }
}

impl Core {
    /// Begins the windows that a new instance reads, and enters those that it and others append to. What has to be done in which source
    /// first, and the sources whose tables change.
    pub fn enter_histories(&mut self, id: u64) -> (Scripts, Vec<SourceId>) {
        let plan = self.instances[&id].plan.clone();
        let (mut fills, mut names) = (Vec::new(), Vec::new());
        for cell in &plan.cells {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let Some(svv) = self.svvs.get_mut(name).filter(|svv| !svv.windows.is_empty()) else { continue };
            names.push(name.clone());
            let home = svv.home.and_then(|home| Some((home, svv.cells.get(&home)?.clone())));
            for window in svv.windows.iter_mut().filter(|window| !window.begun) {
                window.begun = true;
                if let Some(((home, value), window)) = home.clone().and_then(|home| Some((home.clone(), window.cells.get(&home.0)?.clone()))) {
                    fills.push((home, Op::Fill { value, window }));
                }
            }
        }
        (by_source(fills), self.renew_appends(&names, &[id]))
    }

    /// Enters the windows of these SVVs, and of the private cells of these instances, with the blocks that append to them. The sources
    /// whose tables change.
    pub fn renew_appends(&mut self, svvs: &[String], instances: &[u64]) -> Vec<SourceId> {
        let writers = svvs.iter().filter_map(|name| self.svvs.get(name)).flat_map(|svv| &svv.writers);
        let mut blocks: Vec<(u64, kernel::BlockId)> = writers.map(|writer| (writer.instance, writer.block)).collect();
        for instance in instances.iter().filter_map(|id| self.instances.get(id)) {
            let writers = instance.installed.windows.keys().flat_map(|(cell, _)| &instance.plan.cells[*cell].writers);
            blocks.extend(writers.map(|(block, _)| (instance.id, instance.installed.blocks[*block].id())));
        }
        let mut changed = Vec::new();
        for (id, block) in blocks {
            let Some(instance) = self.instances.get(&id) else { continue };
            let Some(index) = instance.installed.blocks.iter().position(|of| of.id() == block) else { continue };
            let (appends, source) = (instance.appends(index, &self.svvs), instance.installed.block_source[index]);
            let Some(step) = self.tables.get_mut(&source).and_then(|table| table.steps.iter_mut().find(|step| step.id == block)) else { continue };
            step.appends = appends;
            changed.push(source);
        }
        changed
    }
}
