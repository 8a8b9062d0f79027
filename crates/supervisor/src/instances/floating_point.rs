// SPDX-License-Identifier: Apache-2.0
//! Changes to the floating-point state: by blocks of a source that was stopped because of it, and by modules when they were loaded.
use crate::instances::table::Instances;
use crate::registry::Registry;
use kernel::SourceId;
use opengpac::FLOATS_CHANGED;
use opengpac::abi::mark;

/// Describes a change found at the end of a firing, and names the blocks that may have caused it: those of downloaded modules, if any.
pub(crate) fn floats_text(instances: &Instances, registry: &Registry, source: SourceId) -> String {
    let there = instances.values().filter(|i| i.is_busy() && i.installed.sources.contains(&source));
    let blocks = there.flat_map(|i| i.plan.blocks.iter().zip(&i.installed.blocks).map(move |(of, block)| (i, of, block)));
    let blocks = blocks.filter(|(_, of, _)| of.source == registry.source_name(source));
    let (loaded, built_in): (Vec<_>, Vec<_>) = blocks.partition(|(.., block)| block.descriptor().reserved & mark::LOADED != 0);
    let suspects = if loaded.is_empty() { built_in } else { loaded };
    let names: Vec<String> = suspects.iter().map(|(i, of, _)| format!("'{}' ({}) of '{}'", of.label, of.block, i.name)).collect();
    match names.as_slice() {
        [] => format!("something {FLOATS_CHANGED}"),
        [one] => format!("block {one} {FLOATS_CHANGED}"),
        several => format!("one of the blocks {} {FLOATS_CHANGED}; each is now checked, so that a fault can name it", several.join(", ")),
    }
}
