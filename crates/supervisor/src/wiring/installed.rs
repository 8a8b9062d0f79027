// SPDX-License-Identifier: Apache-2.0
//! A plan in memory: locations of its blocks, cells and connections.
use kernel::{Activation, Block, Cell, Inbound, Process, SourceId, Window};
use model::interface::Interface;
use model::plan::Plan;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Source of each cell that has writers in several sources: planned cell → source.
pub(crate) type Homes = BTreeMap<usize, SourceId>;

/// Windows that the blocks of an instance read: (planned cell, number of values) → window in each image.
pub(crate) type Windows = BTreeMap<(usize, u32), BTreeMap<SourceId, Window>>;

/// A queue member for which an activation of the plan waits.
pub(crate) struct Gate {
    /// SVV of another instance, if the member carries one.
    pub svv: Option<String>,
    pub activation: usize,
    pub inbound: Arc<Inbound>,
    pub member: usize,
}

/// A plan in memory.
pub(crate) struct InstalledPlan {
    /// Sources that have blocks of the plan, in the plan's order.
    pub sources: Vec<SourceId>,
    /// Blocks, by planned block.
    pub blocks: Vec<Arc<Block>>,
    pub interfaces: Vec<Arc<Interface>>,
    pub block_source: Vec<SourceId>,
    /// Activations, by planned activation.
    pub activations: Vec<Arc<Activation>>,
    pub activation_source: Vec<SourceId>,
    /// Number and time of each activation's last invocation.
    pub stamps: Vec<Cell>,
    /// Cells, by planned cell, one per image.
    pub cells: Vec<BTreeMap<SourceId, Cell>>,
    pub process: Arc<Process>,
    /// Copies before and after each block.
    pub before: Vec<Vec<(Cell, Cell)>>,
    pub after: Vec<Vec<(Cell, Cell)>>,
    /// Cells of inputs that receive values one at a time: (source, block, item, cell).
    pub delays: Vec<(SourceId, usize, usize, Cell)>,
    /// Locations of cells that are written by blocks of several sources.
    pub homes: Homes,
    /// Stamps of private cells that several blocks write, in each image, in the same way as for SVVs.
    pub own_stamps: BTreeMap<usize, BTreeMap<SourceId, Cell>>,
    /// Windows that the plan's blocks read.
    pub windows: Windows,
    /// Gates for which the plan's data-driven activations wait.
    pub gates: Vec<Gate>,
}

impl InstalledPlan {
    /// Returns the cell's copy in the image of `source`; `None` if that image has none.
    pub fn cell(&self, index: usize, source: SourceId) -> Option<&Cell> {
        self.cells[index].get(&source)
    }
}

impl InstalledPlan {
    /// Returns the source in which a planned cell is currently written, or that of a reader if no block writes it.
    pub fn home(&self, plan: &Plan, cell: usize) -> Option<SourceId> {
        let planned = &plan.cells[cell];
        let first = || planned.writers.first().or(planned.readers.first()).map(|(block, _)| self.block_source[*block]);
        self.homes.get(&cell).copied().or_else(first)
    }
}
