// SPDX-License-Identifier: Apache-2.0
//! Installation of a plan: memory in the image of each source, blocks with their addresses, and activations. Blocks of the plan do not
//! run yet, and running instances are not disturbed; a failed installation leaves nothing behind.
use crate::definitions::catalog::Catalog;
use crate::numbers::Numbers;
use crate::refuse::refuse;
use crate::registry::Registry;
use crate::svvs::cells::lay_side_by_side;
use crate::wiring::connect::{Delays, HalfQueue, open, queues};
use crate::wiring::follow::due;
use crate::wiring::homes::{first_homes, writer_for};
use crate::wiring::installed::{Gate, InstalledPlan, Windows};
use crate::wiring::instance_windows::make_windows;
use crate::wiring::ports::cells_of;
use kernel::{Activation, Block, BlockId, Cell, Extent, SourceId};
use model::interface::{Kind, Mode};
use model::plan::{Binding, Bound, CellKind, Plan, PlannedCell};
use model::refusal::{Class, Refusals};
use runtime::Host;
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

/// Memory layout of one image under construction.
#[derive(Default)]
struct Layout {
    len: usize,
}

impl Layout {
    fn take(&mut self, len: usize, align: usize) -> usize {
        let at = self.len.next_multiple_of(align.max(1));
        self.len = at + len;
        at
    }
}

/// Offsets of all items, computed before the memory is allocated.
struct Places {
    stamps: Vec<usize>,
    cells: Vec<Vec<(SourceId, usize)>>,
    /// Cells owned by each block, as (item, offset): gather cells of array ports, and delay cells of ratio inputs.
    own: Vec<Vec<(usize, usize)>>,
    blocks: Vec<usize>,
    extents: BTreeMap<SourceId, Arc<Extent>>,
}

impl Places {
    /// Returns the cell owned by block `block` for an item.
    fn own(&self, site: &Site, block: usize, item: usize, size: usize) -> Cell {
        let offset = self.own[block].iter().find(|(i, _)| *i == item).expect("laid out before").1;
        self.extents[&site.block_source[block]].cell(offset, size)
    }
}

/// Context shared by the parts of an installation.
struct Site<'a> {
    plan: &'a Plan,
    catalog: &'a Catalog,
    block_source: Vec<SourceId>,
    activation_source: Vec<SourceId>,
    /// Inputs that receive values one at a time through a queue: (block, item).
    queued: HashSet<(usize, usize)>,
}

/// Installs a plan in memory, with the queues for its synchronous inputs from other sources (which are not in any table yet).
pub(crate) fn install(
    registry: &mut Registry,
    host: &Host,
    numbers: &mut Numbers,
    catalog: &Catalog,
    plan: &Plan,
    (instance, name): (u64, &str),
) -> Result<(InstalledPlan, Vec<HalfQueue>), Refusals> {
    let source_of = |registry: &Registry, name: &str| {
        registry.sources.get(name).copied().ok_or_else(|| refuse(Class::UnknownName, format!("there is no source '{name}'"), ""))
    };
    let block_source = plan.blocks.iter().map(|b| source_of(registry, &b.source)).collect::<Result<Vec<_>, _>>()?;
    let activation_source = plan.activations.iter().map(|a| source_of(registry, &a.source)).collect::<Result<Vec<_>, _>>()?;
    let queued = queued(registry, plan, &block_source);
    let site = Site { plan, catalog, block_source, activation_source, queued };
    for block in &plan.blocks {
        if !catalog.blocks.contains_key(&block.block) {
            return Err(refuse(Class::UnknownName, format!("block '{}' is no longer downloaded", block.block), "download its module again"));
        }
    }
    let places = lay_out(&site);
    let cells = make_cells(registry, &site, &places);
    let windows = make_windows(registry, plan, &site.block_source, &cells);
    let stamps: Vec<Cell> = (0..plan.activations.len()).map(|i| places.extents[&site.activation_source[i]].cell(places.stamps[i], kernel::STAMP_LEN)).collect();
    stamps.iter().for_each(|stamp| stamp.store(&kernel::unstamped()));
    let delays = delays(&site, &places);
    let queues = open(queues(registry, host, plan, &site.block_source, &cells, &delays, None));
    let gates: Vec<Gate> = queues.iter().flat_map(HalfQueue::gates).collect();
    let activations = make_activations(registry, &site, &stamps, &gates);
    let mut copies = Copying { before: vec![Vec::new(); plan.blocks.len()], after: vec![Vec::new(); plan.blocks.len()] };
    let blocks = make_blocks(numbers, &site, &places, (&cells, &windows), name, &mut copies);
    let mut sources = site.block_source.clone();
    sources.sort();
    sources.dedup();
    let process = host.process(instance, instance, &sources);
    let delays = delays.into_iter().map(|((block, item), cell)| (site.block_source[block], block, item, cell)).collect();
    let interfaces = plan.blocks.iter().map(|b| catalog.blocks[&b.block].interface.clone()).collect();
    let (homes, own_stamps) = (first_homes(plan, &site.block_source), own_stamps(&site));
    let installed = InstalledPlan {
        homes,
        own_stamps,
        sources,
        blocks,
        interfaces,
        block_source: site.block_source,
        activations,
        activation_source: site.activation_source,
        stamps,
        cells,
        process,
        before: copies.before,
        after: copies.after,
        delays,
        windows,
        gates,
    };
    Ok((installed, queues))
}

/// Creates stamps for private cells that several blocks write, in the images of these blocks.
fn own_stamps(site: &Site) -> BTreeMap<usize, BTreeMap<SourceId, Cell>> {
    let several = |(_, cell): &(usize, &PlannedCell)| cell.writers.len() > 1 && matches!(cell.kind, CellKind::Private { .. });
    let stamp = |(block, _): &(usize, usize)| {
        let stamp = Extent::new(kernel::STAMP_LEN).cell(0, kernel::STAMP_LEN);
        stamp.store(&kernel::unstamped());
        (site.block_source[*block], stamp)
    };
    site.plan.cells.iter().enumerate().filter(several).map(|(index, cell)| (index, cell.writers.iter().map(stamp).collect())).collect()
}

/// Creates the activations, each with the rule by which it is due. In a plan, activations that drive others come first.
fn make_activations(registry: &Registry, site: &Site, stamps: &[Cell], gates: &[Gate]) -> Vec<Arc<Activation>> {
    let mut activations: Vec<Arc<Activation>> = Vec::with_capacity(stamps.len());
    for (index, planned) in site.plan.activations.iter().enumerate() {
        let due = due(registry, site.plan, &activations, gates, (index, site.activation_source[index]));
        activations.push(Activation::with_budget(due, Some(stamps[index].clone()), planned.budget_ns));
    }
    activations
}

/// Returns the sources whose images contain a planned cell.
fn cell_sources(site: &Site, index: usize) -> Vec<SourceId> {
    let cell = &site.plan.cells[index];
    let mut sources: Vec<SourceId> = cell.writers.iter().chain(&cell.readers).map(|(b, _)| site.block_source[*b]).collect();
    sources.sort();
    sources.dedup();
    sources
}

/// Lays out the images: stamps, private cells, gather cells, blocks in firing order; then allocates the memory.
fn lay_out(site: &Site) -> Places {
    let plan = site.plan;
    let mut layouts: BTreeMap<SourceId, Layout> = BTreeMap::new();
    let stamps = site.activation_source.iter().map(|s| layouts.entry(*s).or_default().take(kernel::STAMP_LEN, 8)).collect();
    let mut cells: Vec<Vec<(SourceId, usize)>> = vec![Vec::new(); plan.cells.len()];
    for (index, cell) in plan.cells.iter().enumerate() {
        if matches!(cell.kind, CellKind::Private { .. } | CellKind::Constant { .. }) {
            for source in cell_sources(site, index) {
                cells[index].push((source, layouts.entry(source).or_default().take(cell.size, cell.align)));
            }
        }
    }
    let mut own: Vec<Vec<(usize, usize)>> = vec![Vec::new(); plan.blocks.len()];
    let mut blocks = vec![0; plan.blocks.len()];
    for (_, order) in &plan.order {
        for &index in order {
            let block = &plan.blocks[index];
            let layout = layouts.entry(site.block_source[index]).or_default();
            for bound in &block.bindings {
                match &bound.binding {
                    Binding::Cells(list) => own[index].push((bound.item, layout.take(list.iter().map(|c| plan.cells[*c].size).sum(), 8))),
                    Binding::Cell(cell) if site.queued.contains(&(index, bound.item)) => {
                        own[index].push((bound.item, layout.take(plan.cells[*cell].size, plan.cells[*cell].align)));
                    }
                    Binding::Cell(_) => {}
                }
            }
            let descriptor = site.catalog.blocks[&block.block].descriptor;
            blocks[index] = layout.take(Block::memory_size(descriptor), descriptor.instance_align as usize);
        }
    }
    let extents = layouts.into_iter().map(|(source, layout)| (source, Extent::new(layout.len.max(8)))).collect();
    Places { stamps, cells, own, blocks, extents }
}

/// Returns the inputs that receive values one at a time through a queue: ratio inputs, and synchronous inputs whose writer runs on
/// another source.
fn queued(registry: &Registry, plan: &Plan, block_source: &[SourceId]) -> HashSet<(usize, usize)> {
    let mut queued = HashSet::new();
    for (index, block) in plan.blocks.iter().enumerate() {
        let is_input = |bound: &&Bound| cells_of(&bound.binding).iter().any(|cell| plan.cells[*cell].readers.contains(&(index, bound.item)));
        for bound in block.bindings.iter().filter(is_input) {
            let is_remote = |cell: &usize| writer_source(registry, plan, block_source, (*cell, index)).is_some_and(|source| source != block_source[index]);
            let by_queue = match bound.mode {
                Mode::Ratio(_) => true,
                Mode::Synchronous => cells_of(&bound.binding).iter().all(is_remote),
                Mode::Asynchronous => false,
            };
            if by_queue {
                queued.insert((index, bound.item));
            }
        }
    }
    queued
}

/// Returns the source of the block that writes a cell for a reader.
fn writer_source(registry: &Registry, plan: &Plan, block_source: &[SourceId], (cell, reader): (usize, usize)) -> Option<SourceId> {
    match (writer_for(plan, cell, reader), &plan.cells[cell].kind) {
        (Some((block, _)), _) => Some(block_source[block]),
        (None, CellKind::Svv { name, .. }) => registry.driver_of(name).map(|writer| writer.source),
        _ => None,
    }
}

/// Creates the cells of inputs that receive values one at a time.
fn delays(site: &Site, places: &Places) -> Delays {
    let mut delays = Delays::new();
    for (index, block) in site.plan.blocks.iter().enumerate() {
        for bound in block.bindings.iter().filter(|bound| site.queued.contains(&(index, bound.item))) {
            let cells = match &bound.binding {
                Binding::Cell(cell) => std::slice::from_ref(cell),
                Binding::Cells(list) => list,
            };
            let size = cells.iter().map(|c| site.plan.cells[*c].size).sum();
            delays.insert((index, bound.item), places.own(site, index, bound.item, size));
        }
    }
    delays
}

/// Creates the cells in each image: private ones in the instance's memory, SVVs and channels at their locations.
fn make_cells(registry: &mut Registry, site: &Site, places: &Places) -> Vec<BTreeMap<SourceId, Cell>> {
    for (index, block) in site.plan.blocks.iter().enumerate() {
        for bound in &block.bindings {
            if let Binding::Cells(list) = &bound.binding {
                lay_out_svvs(registry, site, list, site.block_source[index]);
            }
        }
    }
    let mut cells = Vec::with_capacity(site.plan.cells.len());
    for (index, planned) in site.plan.cells.iter().enumerate() {
        let in_images = match &planned.kind {
            CellKind::Private { .. } | CellKind::Constant { .. } => places.cells[index]
                .iter()
                .map(|(source, offset)| {
                    let cell = places.extents[source].cell(*offset, planned.size);
                    cell.store(&planned.initial);
                    (*source, cell)
                })
                .collect(),
            CellKind::Svv { name, .. } => {
                let sources = cell_sources(site, index);
                let svv = registry.svvs.get_mut(name).expect("the plan was made from the SVVs that exist");
                sources.into_iter().map(|source| (source, svv.cell(source))).collect()
            }
            CellKind::Channel { device, channel, .. } => {
                let physical = &registry.physical[device];
                BTreeMap::from([(physical.source, physical.device.cell(*channel))])
            }
        };
        cells.push(in_images);
    }
    cells
}

/// Lays out contiguously the SVVs that an array port reads, if they are new in that image.
fn lay_out_svvs(registry: &mut Registry, site: &Site, list: &[usize], source: SourceId) {
    let names: Option<Vec<&str>> = list
        .iter()
        .map(|c| match &site.plan.cells[*c].kind {
            CellKind::Svv { name, .. } => Some(name.as_str()),
            _ => None,
        })
        .collect();
    let Some(names) = names else { return };
    let mut picked: Vec<(usize, &mut crate::svvs::cells::SvvRecord)> =
        registry.svvs.iter_mut().filter_map(|(name, record)| names.iter().position(|n| n == name).map(|at| (at, record))).collect();
    if picked.len() == names.len() {
        picked.sort_by_key(|(at, _)| *at);
        let mut records: Vec<_> = picked.into_iter().map(|(_, record)| record).collect();
        lay_side_by_side(&mut records, source);
    }
}

type Copies = Vec<(Cell, Cell)>;

/// Copies that an installation requires around its blocks.
struct Copying {
    before: Vec<Copies>,
    after: Vec<Copies>,
}

/// Creates the bound blocks and the copies around them.
fn make_blocks(
    numbers: &mut Numbers,
    site: &Site,
    places: &Places,
    (cells, windows): (&[BTreeMap<SourceId, Cell>], &Windows),
    name: &str,
    copies: &mut Copying,
) -> Vec<Arc<Block>> {
    let mut blocks = Vec::with_capacity(site.plan.blocks.len());
    for (index, planned) in site.plan.blocks.iter().enumerate() {
        let source = site.block_source[index];
        let code = &site.catalog.blocks[&planned.block];
        let memory = places.extents[&source].cell(places.blocks[index], Block::memory_size(code.descriptor));
        let id = BlockId(u32::try_from(numbers.fresh()).expect("fewer than 2^32 blocks in the life of a system"));
        let mut block = Block::install(id, &format!("{name}.{}", planned.label), code.descriptor, code.module.clone(), memory);
        for (item, bytes) in &planned.values {
            block.set(*item, bytes);
        }
        for bound in &planned.bindings {
            match &bound.binding {
                Binding::Cell(cell) if bound.history > 0 => block.bind(bound.item, windows[&(*cell, bound.history)][&source].cell()),
                Binding::Cell(cell) if site.queued.contains(&(index, bound.item)) => {
                    block.bind(bound.item, &places.own(site, index, bound.item, site.plan.cells[*cell].size))
                }
                Binding::Cells(list) if site.queued.contains(&(index, bound.item)) => {
                    block.bind(bound.item, &places.own(site, index, bound.item, list.iter().map(|c| site.plan.cells[*c].size).sum()));
                }
                Binding::Cell(cell) => block.bind(bound.item, &cells[*cell][&source]),
                Binding::Cells(list) => {
                    let parts: Vec<Cell> = list.iter().map(|c| cells[*c][&source].clone()).collect();
                    if parts.windows(2).all(|pair| pair[0].adjoins(&pair[1])) {
                        block.bind(bound.item, &parts[0].widened(parts.iter().map(Cell::len).sum()));
                        continue;
                    }
                    let whole = places.own(site, index, bound.item, parts.iter().map(Cell::len).sum());
                    block.bind(bound.item, &whole);
                    let reads = matches!(code.interface.items[bound.item].kind, Kind::Input | Kind::DeviceRead);
                    let (before, after) = (&mut copies.before[index], &mut copies.after[index]);
                    pair_up(whole, parts, |part, piece| if reads { before.push((part, piece)) } else { after.push((piece, part)) });
                }
            }
        }
        blocks.push(Arc::new(block));
    }
    blocks
}

/// Pairs each part with the corresponding piece of the whole.
fn pair_up(whole: Cell, parts: Vec<Cell>, mut pair: impl FnMut(Cell, Cell)) {
    let mut offset = 0;
    for part in parts {
        let piece = whole.part(offset, part.len());
        offset += part.len();
        pair(part, piece);
    }
}
