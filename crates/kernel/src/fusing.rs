// SPDX-License-Identifier: Apache-2.0
//! Fused blocks: adjacent blocks that share one entry.
use crate::bank::{FusedSteps, stretches};
use crate::block::Block;
use crate::containment::trust_code;
use crate::table::Table;
use opengpac::bank::Bank;
use std::ops::Range;
use std::ptr::fn_addr_eq;
use std::sync::Arc;

impl Table {
    /// Returns the table with fused blocks. `find` is called with each run of adjacent blocks that are always due together and have their
    /// own entries; it returns the ranges that have a common entry, in order. For each block, that entry must do the same as the block's
    /// own. Off the real-time path.
    #[must_use]
    pub fn fused(mut self, mut find: impl FnMut(&[&Arc<Block>]) -> Vec<(Range<usize>, Bank)>) -> Table {
        let mut fused: Vec<FusedSteps> = Vec::new();
        for strip in &self.strips {
            let own = |step: u32| {
                let block = self.steps[step as usize].block.as_ref()?;
                fn_addr_eq(self.calls[step as usize].run, block.descriptor().run).then_some(block)
            };
            let mut start = strip.start;
            while start < strip.end {
                let run: Vec<&Arc<Block>> = (start..strip.end).map_while(own).collect();
                fused.extend(find(&run).into_iter().map(|(blocks, entry)| (start + blocks.start as u32..start + blocks.end as u32, entry)));
                start += run.len() as u32 + 1;
            }
        }
        fused.iter().for_each(|(_, entry)| trust_code(*entry as *const _));
        self.stretches = stretches(&self.strips, &self.calls, &fused);
        self
    }
}
