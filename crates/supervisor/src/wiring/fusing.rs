// SPDX-License-Identifier: Apache-2.0
//! Fused groups of blocks: the entries that there are, and whether tables get them.
use kernel::{Block, Table};
use modules::fused::{Member, NotFused};
use opengpac::bank::Bank;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Entries by what they are made of: a group that is there again, in another instance or later, has its own already.
#[derive(Default)]
pub(crate) struct Fusing {
    pub is_on: bool,
    made: HashMap<Vec<Member>, Result<Bank, NotFused>>,
}

/// Blocks of one source that are fused, or could be.
pub(crate) struct Candidate {
    /// `instance.label`, in their order.
    pub blocks: Vec<String>,
    pub members: Vec<Member>,
}

impl Fusing {
    /// Switches on or off whether tables get these entries; what a compiler has refused is tried again.
    pub fn switch(&mut self, on: bool) {
        self.is_on = on;
        self.made.retain(|_, made| made.is_ok());
    }

    pub fn keep(&mut self, members: Vec<Member>, made: Result<Bank, NotFused>) {
        self.made.insert(members, made);
    }

    /// Its entry, or why there is none; `None`: nobody has compiled it so far.
    pub fn made(&self, members: &[Member]) -> Option<&Result<Bank, NotFused>> {
        self.made.get(members)
    }

    /// Returns the table, with the entries of its groups.
    pub fn fuse(&self, table: Table) -> Table {
        if self.is_on { table.fused(|blocks| self.entries(blocks)) } else { table }
    }

    fn entries(&self, blocks: &[&Arc<Block>]) -> Vec<(Range<usize>, Bank)> {
        let groups = runtime::groups(blocks).into_iter();
        groups.filter_map(|group| Some((group.blocks, *self.made.get(&group.members)?.as_ref().ok()?))).collect()
    }
}

/// Returns the groups of a table, whether they are fused or not.
pub(crate) fn candidates(table: Table) -> Vec<Candidate> {
    let mut found = Vec::new();
    let _ = table.fused(|blocks| {
        let named = |range: Range<usize>| blocks[range].iter().map(|block| block.name().to_owned()).collect();
        found.extend(runtime::groups(blocks).into_iter().map(|group| Candidate { blocks: named(group.blocks), members: group.members }));
        Vec::new()
    });
    found
}
