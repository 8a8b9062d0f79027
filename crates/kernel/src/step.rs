// SPDX-License-Identifier: Apache-2.0
//! Steps and rings of rows, from which a table is built.
use crate::block::Block;
use crate::memory::Cell;
use crate::process::Process;
use crate::rows::RowsEnd;
use crate::schedule::Activation;
use crate::window::Window;
use std::collections::HashMap;
use std::sync::Arc;

/// Work done by a step.
pub enum StepKind {
    /// One invocation of a block.
    Block(Arc<Block>),
    /// Copies cells: for the gather or scatter of an array port, or for the delay of a ratio input within a source.
    Copy(Vec<(Cell, Cell)>),
    /// Appends the values stored by an earlier step's block to their windows.
    Append(Vec<Append>),
}

/// A value that a block stores, and the window of its most recent values. Input items that declare a history are bound to windows.
#[derive(Clone)]
pub struct Append {
    /// Block that stores the value.
    pub block: Arc<Block>,
    /// n if the block's output is a ratio output n, else 1: the value is stored by invocations n, 2n, ….
    pub ratio: u32,
    /// Newest value.
    pub value: Cell,
    /// Most recent values, oldest first.
    pub window: Window,
}

/// A step, with its activation and its process.
pub struct Step {
    /// Work done by the step.
    pub kind: StepKind,
    /// Activation that determines when the step is due.
    pub activation: Arc<Activation>,
    /// Process to which the step reports its conditions, and whose running time it sees.
    pub process: Arc<Process>,
    /// Indices of the earlier steps of this table whose outputs this step reads synchronously: if one of them faulted or did not run in
    /// this firing, this step is not due.
    pub drivers: Vec<u32>,
}

/// Ring of rows, read by the PS, a scope or the recorder: these cells are copied into a row at the end of each firing.
pub struct Rows {
    /// Cells in order, without gaps.
    pub cells: Vec<Cell>,
    /// Writing end of the ring.
    pub writer: Arc<RowsEnd>,
}

/// Returns each activation once, preceded by its drivers.
pub(crate) fn in_driving_order(steps: &[Step]) -> Vec<Arc<Activation>> {
    fn visit(activation: &Arc<Activation>, seen: &mut HashMap<*const Activation, ()>, order: &mut Vec<Arc<Activation>>) {
        if seen.insert(Arc::as_ptr(activation), ()).is_none() {
            activation.planned_drivers().iter().for_each(|(driver, _)| visit(driver, seen, order));
            order.push(activation.clone());
        }
    }
    let (mut seen, mut order) = (HashMap::new(), Vec::new());
    for (index, step) in steps.iter().enumerate() {
        if index == 0 || !Arc::ptr_eq(&step.activation, &steps[index - 1].activation) {
            visit(&step.activation, &mut seen, &mut order);
        }
    }
    order
}
