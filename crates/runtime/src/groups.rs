// SPDX-License-Identifier: Apache-2.0
//! Groups of blocks that can be fused: adjacent blocks of C sources in a table, where one block reads a value that another has just
//! stored.
use kernel::{Block, Cell};
use modules::fused::{FUSED_MAX, Member, Wire, fit};
use opengpac::abi::{Item, flag, kind, mode};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Blocks that can be fused, as a range of the blocks passed in.
pub struct Group {
    pub blocks: Range<usize>,
    pub members: Vec<Member>,
}

/// Finds the groups among blocks that are always due together and run in this order. Off the real-time path.
pub fn groups(blocks: &[&Arc<Block>]) -> Vec<Group> {
    let mut found = Vec::new();
    let mut start = 0;
    for run in blocks.chunk_by(|one, next| is_fit(one) && is_fit(next)) {
        for chunk in run.chunks(FUSED_MAX) {
            found.extend(group(chunk).map(|Group { blocks, members }| Group { blocks: start + blocks.start..start + blocks.end, members }));
            start += chunk.len();
        }
    }
    found
}

fn is_fit(block: &Arc<Block>) -> bool {
    fit(block.descriptor()).is_ok()
}

/// Returns the group from the first block whose value another block reads to the last block that reads such a value; the other blocks
/// would not benefit.
fn group(blocks: &[&Arc<Block>]) -> Option<Group> {
    let mut stored: HashMap<CellSpan, (usize, usize)> = HashMap::new();
    let mut members: Vec<Member> = Vec::with_capacity(blocks.len());
    for (index, block) in blocks.iter().enumerate() {
        let read = bound(block).filter(|(_, item, _)| item.kind == kind::INPUT && item.flags & (flag::SIZED | flag::HISTORY) == 0);
        let wires = read.filter_map(|(input, item, cell)| stored.get(&place(item, cell)).map(|&(from, output)| Wire { input, from, output })).collect();
        members.push(Member { descriptor: block.descriptor(), wires });
        // A ratio output is not stored at every invocation.
        let is_whole = |item: &Item| item.mode != mode::RATIO && item.flags & flag::SIZED == 0;
        let writes = bound(block).filter(|(_, item, _)| item.kind == kind::OUTPUT);
        for (output, item, cell) in writes {
            let written = place(item, cell);
            stored.retain(|other, _| !overlap(*other, written));
            if is_whole(item) {
                stored.insert(written, (index, output));
            }
        }
    }
    let first = members.iter().flat_map(|member| &member.wires).map(|wire| wire.from).min()?;
    let last = members.iter().rposition(|member| !member.wires.is_empty())?;
    let mut members: Vec<Member> = members.drain(first..=last).collect();
    members.iter_mut().flat_map(|member| &mut member.wires).for_each(|wire| wire.from -= first);
    Some(Group { blocks: first..last + 1, members })
}

/// Offset and length of a value.
type CellSpan = (usize, u32);

fn place(item: &Item, cell: &Cell) -> CellSpan {
    (cell.start() as usize, item.size)
}

fn overlap((one, length): CellSpan, (other, of): CellSpan) -> bool {
    one < other + of as usize && other < one + length as usize
}

/// Returns the items of a block that are bound to a cell.
fn bound(block: &Block) -> impl Iterator<Item = (usize, &Item, &Cell)> {
    let (_, _, bound) = block.parts();
    block.items().iter().zip(bound).enumerate().filter_map(|(index, (item, cell))| Some((index, item, cell.as_ref()?)))
}
