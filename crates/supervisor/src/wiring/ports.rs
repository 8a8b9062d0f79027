// SPDX-License-Identifier: Apache-2.0
//! Planned properties of a single port.
use model::interface::Mode;
use model::plan::{Binding, Plan};

/// Returns the mode of a port of a planned block.
pub(crate) fn mode_of(plan: &Plan, block: usize, item: usize) -> Mode {
    plan.blocks[block].bindings.iter().find(|b| b.item == item).map_or(Mode::Asynchronous, |b| b.mode)
}

/// Returns the cells of a binding.
pub(crate) fn cells_of(binding: &Binding) -> &[usize] {
    match binding {
        Binding::Cell(cell) => std::slice::from_ref(cell),
        Binding::Cells(list) => list,
    }
}
