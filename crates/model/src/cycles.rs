// SPDX-License-Identifier: Apache-2.0
//! Cycles of synchronous ports: finds and names them, and suggests modes that relax them.
use crate::flatten::{FlatBlock, Group, Port};
use crate::interface::{Kind, Mode};
use crate::order;
use crate::refusal::{Class, Refusal, SourceLocation, Where};

/// Returns a refusal if the definition contains a cycle of synchronous ports.
pub(crate) fn synchronous_cycle(blocks: &[FlatBlock], groups: &[Group], group_of: &[Vec<Option<u32>>], place: &Option<SourceLocation>) -> Option<Refusal> {
    let mut edges = Vec::new();
    for group in groups {
        for writer in group.ports.iter().filter(|p| blocks[p.0].kind.item(p.1).kind == Kind::Output) {
            for reader in group.ports.iter().filter(|p| is_synchronous_input(blocks, **p)) {
                edges.push((writer.0, reader.0));
            }
        }
    }
    debug_assert_eq!(group_of.len(), blocks.len());
    let cycle = order::find_cycle(blocks.len(), &edges)?;
    let (first, last) = (*cycle.first()?, *cycle.last()?);
    let closing = groups.iter().filter(|group| group.ports.iter().any(|p| p.0 == last && blocks[last].kind.item(p.1).kind == Kind::Output));
    let relaxed: Vec<usize> = closing.flat_map(|group| &group.ports).filter(|p| p.0 == first && is_synchronous_input(blocks, **p)).map(|p| p.1).collect();
    let labels: Vec<&str> = cycle.iter().map(|&block| blocks[block].label.as_str()).collect();
    Some(cycle_refusal(&labels, &modes_of(&blocks[first], &relaxed), place))
}

/// Returns the `modes=` text that relaxes these inputs of a block. The modes of a block within a graph are declared in that graph.
pub(crate) fn modes_of(block: &FlatBlock, items: &[usize]) -> String {
    let relaxed: Vec<String> = items.iter().map(|item| format!("'{}.{}': 'asynchronous'", block.label, block.kind.interface.items[*item].name)).collect();
    if relaxed.is_empty() || block.label.contains('.') { "modes=".to_owned() } else { format!("modes={{{}}}", relaxed.join(", ")) }
}

/// Returns the `modes=` text that relaxes all synchronous inputs of a block.
pub(crate) fn modes_of_all(block: &FlatBlock) -> String {
    let is_synchronous = |item: &usize| block.kind.item(*item).kind == Kind::Input && block.mode(*item) == Mode::Synchronous;
    modes_of(block, &(0..block.kind.interface.items.len()).filter(is_synchronous).collect::<Vec<_>>())
}

/// Returns the `modes=` text for the first block of a cycle that is known only by its labels.
pub(crate) fn modes_of_first(blocks: &[FlatBlock], labels: &[&str]) -> String {
    let first = blocks.iter().find(|block| labels.first() == Some(&block.label.as_str()));
    first.map_or_else(|| "modes=".to_owned(), modes_of_all)
}

pub(crate) fn is_synchronous_input(blocks: &[FlatBlock], (block, item): Port) -> bool {
    blocks[block].kind.item(item).kind == Kind::Input && blocks[block].mode(item) == Mode::Synchronous
}

/// Returns the refusal of a cycle. `modes` is the text that relaxes one of its inputs.
pub(crate) fn cycle_refusal(labels: &[&str], modes: &str, place: &Option<SourceLocation>) -> Refusal {
    let path: Vec<String> = labels.iter().chain(labels.first()).map(|label| format!("'{label}'")).collect();
    let about = labels.iter().map(|label| Where::Block { block: (*label).to_owned() });
    Refusal::new(Class::SynchronousCycle, format!("synchronous ports form a cycle: {}", path.join(" → ")))
        .remedy(format!("relax one of the inputs, for example with {modes}"))
        .at(place)
        .about(about)
}
