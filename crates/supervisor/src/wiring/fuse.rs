// SPDX-License-Identifier: Apache-2.0
//! Fusing: compiles C blocks that are always due together into one entry point, from their sources.
use crate::core::Core;
use crate::system::System;
use crate::wiring::fusing::Candidate;
use kernel::{SourceId, floats};
use model::refusal::Refusals;
use modules::fused::{Member, fit, fuse};
use serde::Serialize;
use std::collections::HashSet;
use std::time::{Duration, Instant};

/// Maximum time for which one call compiles; the caller repeats the call and may stop in between.
const SLICE: Duration = Duration::from_secs(1);

/// Groups of fused blocks, and blocks that are not fused.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FusedBlocks {
    /// True if tables use the available entry points. This also applies to future instances.
    pub on: bool,
    /// Number of groups that have not been compiled yet, with which `fuse` continues.
    pub waiting: u32,
    /// Groups of blocks, identified by their sources.
    pub groups: Vec<FusedGroup>,
    /// Blocks that cannot be fused.
    pub single: Vec<SingleBlock>,
}

/// Consecutive blocks that are always due together, some of which read values stored by others.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FusedGroup {
    /// Interrupt source on which the blocks run.
    pub source: String,
    /// Labels of the blocks, as `instance.label`, in execution order.
    pub blocks: Vec<String>,
    /// True if the group runs through one entry point.
    pub fused: bool,
    /// Reason why the group has no entry point.
    pub why: Option<String>,
}

/// A block that cannot be fused, and therefore runs on its own.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SingleBlock {
    /// Label of the block, as `instance.label`.
    pub block: String,
    /// Reason why the block cannot be fused.
    pub why: String,
}

impl System {
    /// Fuses the installed blocks, and future ones of the same kind with the same wiring; undoes this if `on` is false. Everything keeps
    /// running, and the results are bit-identical. Returns after about a second; call it again if some groups are still `waiting` to be
    /// compiled. A group that cannot be compiled runs block by block, as before; the answer contains the reason.
    ///
    /// # Errors
    /// Fails if the system is closed.
    pub fn fuse(&self, on: bool) -> Result<FusedBlocks, Refusals> {
        let begun = Instant::now();
        self.shared.command(|core| {
            if core.wiring.fusing.is_on != on {
                core.wiring.fusing.switch(on);
                renew(core, |_| true);
            }
            Ok(())
        })?;
        let mut made: HashSet<Vec<Member>> = HashSet::new();
        for members in if on { self.shared.ask(|core| Ok(waiting(core, &candidates(core))))? } else { HashSet::new() } {
            if begun.elapsed() > SLICE {
                break;
            }
            // Nothing is locked while the compiler runs.
            let entry = fuse(&members);
            self.shared.locked().wiring.fusing.keep(members.clone(), entry);
            made.insert(members);
        }
        if !made.is_empty() {
            self.shared.command(|core| {
                renew(core, |candidate| made.contains(&candidate.members));
                Ok(())
            })?;
        }
        Ok(self.fused())
    }

    /// Returns the groups of fused blocks, and the blocks that are not fused, with the reasons.
    pub fn fused(&self) -> FusedBlocks {
        let core = self.shared.locked();
        let fusing = &core.wiring.fusing;
        let found: Vec<(SourceId, Candidate)> = candidates(&core);
        let waiting = if fusing.is_on { waiting(&core, &found).len() as u32 } else { 0 };
        let groups = found.iter().map(|(source, Candidate { blocks, members })| {
            let made = fusing.made(members);
            FusedGroup {
                source: core.registry.source_name(*source).to_owned(),
                blocks: blocks.clone(),
                fused: fusing.is_on && matches!(made, Some(Ok(_))),
                why: made.and_then(|made| made.as_ref().err()).map(ToString::to_string),
            }
        });
        let single = sources(&core).flat_map(|(source, table)| {
            let remote = core.remote.at(core.registry.source_name(source)).map(|remote| format!("it runs in the process of {}", core.remote.called(remote)));
            table.steps.iter().filter_map(move |record| {
                let watched = || floats::are_looked_at(&record.block).then(|| "its floating-point state is checked after each invocation".to_owned());
                let why = remote.clone().or_else(|| fit(record.block.descriptor()).err().map(|why| why.to_string())).or_else(watched);
                Some(SingleBlock { block: record.block.name().to_owned(), why: why? })
            })
        });
        FusedBlocks { on: fusing.is_on, waiting, groups: groups.collect(), single: single.collect() }
    }
}

fn sources(core: &Core) -> impl Iterator<Item = (SourceId, &crate::wiring::tables::SourceTable)> {
    core.wiring.tables.iter().map(|(source, table)| (*source, table))
}

/// Returns the groups of all sources of this process.
fn candidates(core: &Core) -> Vec<(SourceId, Candidate)> {
    let here = sources(core).filter(|(source, _)| core.remote.at(core.registry.source_name(*source)).is_none());
    here.flat_map(|(source, table)| table.candidates().into_iter().map(move |candidate| (source, candidate))).collect()
}

/// Returns the members of each group in `among` that has not been compiled yet.
fn waiting(core: &Core, among: &[(SourceId, Candidate)]) -> HashSet<Vec<Member>> {
    among.iter().map(|(_, candidate)| &candidate.members).filter(|members| core.wiring.fusing.made(members).is_none()).cloned().collect()
}

/// Rebuilds the tables of the sources whose groups satisfy `of`.
fn renew(core: &mut Core, of: impl Fn(&Candidate) -> bool) {
    let mut sources: Vec<SourceId> = candidates(core).iter().filter(|(_, candidate)| of(candidate)).map(|(source, _)| *source).collect();
    sources.dedup();
    core.carrier().renew_tables(sources);
}
