// SPDX-License-Identifier: Apache-2.0
//! Fused groups of blocks: the available entry points, and whether tables use them.
use kernel::{Block, Table};
use modules::fused::{Member, NotFused};
use opengpac::bank::Bank;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Entry points by group members: if a group recurs, in another instance or at a later time, its entry point already exists.
#[derive(Default)]
pub(crate) struct Fusing {
    pub is_on: bool,
    made: HashMap<Vec<Member>, Result<Bank, NotFused>>,
}

/// Blocks on one source that are or could be fused.
pub(crate) struct Candidate {
    /// Labels of the blocks, as `instance.label`, in order.
    pub blocks: Vec<String>,
    pub members: Vec<Member>,
}

impl Fusing {
    /// Sets whether tables use the entry points; compilations that failed are retried.
    pub fn switch(&mut self, on: bool) {
        self.is_on = on;
        self.made.retain(|_, made| made.is_ok());
    }

    pub fn keep(&mut self, members: Vec<Member>, made: Result<Bank, NotFused>) {
        self.made.insert(members, made);
    }

    /// Returns the entry point of a group, or the reason why there is none; `None` if the group has not been compiled yet.
    pub fn made(&self, members: &[Member]) -> Option<&Result<Bank, NotFused>> {
        self.made.get(members)
    }

    /// Returns the table with the entry points of its groups.
    pub fn fuse(&self, table: Table) -> Table {
        if self.is_on { table.fused(|blocks| self.entries(blocks)) } else { table }
    }

    fn entries(&self, blocks: &[&Arc<Block>]) -> Vec<(Range<usize>, Bank)> {
        let groups = runtime::groups(blocks).into_iter();
        groups.filter_map(|group| Some((group.blocks, *self.made.get(&group.members)?.as_ref().ok()?))).collect()
    }
}

/// Returns the groups of a table, whether fused or not.
pub(crate) fn candidates(table: Table) -> Vec<Candidate> {
    let mut found = Vec::new();
    let _ = table.fused(|blocks| {
        let named = |range: Range<usize>| blocks[range].iter().map(|block| block.name().to_owned()).collect();
        found.extend(runtime::groups(blocks).into_iter().map(|group| Candidate { blocks: named(group.blocks), members: group.members }));
        Vec::new()
    });
    found
}
