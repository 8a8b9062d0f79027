// SPDX-License-Identifier: Apache-2.0
//! Durations of blocks, as the kernels' probes have seen them.
use crate::refuse::{refuse, unknown};
use crate::system::{System, SystemState};
use kernel::SourceId;
use model::refusal::{Class, Refusals};
use serde::Serialize;
use std::collections::HashMap;

/// Maximum time of a probe. An observer asks again before it is over, so no probe is left behind for longer.
pub const PROBE_MAX_NS: u64 = 3_600_000_000_000;

/// Durations of a block's invocations, as far as a probe has measured them.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BlockTimes {
    /// The verb instance.
    pub instance: String,
    /// A block of a nested graph: `outer.inner.block`.
    pub label: String,
    /// `module.block`.
    pub block: String,
    /// Invocations that were measured.
    pub samples: u64,
    /// The last of them, ns.
    pub last_ns: u64,
    /// Their mean, ns.
    pub mean_ns: f64,
    /// The longest of them, ns.
    pub max_ns: u64,
    /// Number of the invocation that was measured last.
    pub number: u64,
}

impl System {
    /// Lets a probe visit the blocks of a source, or of all sources, one a firing, for the next `for_ns` of real time. Several
    /// observers cost no more than one. It changes nothing that is computed, and costs three readings of the clock a firing.
    ///
    /// # Errors
    /// No such source; more than an hour.
    pub fn probe(&self, source: Option<&str>, for_ns: u64) -> Result<(), Refusals> {
        if for_ns > PROBE_MAX_NS {
            let asked = format!("block times are asked for during {} s", for_ns / 1_000_000_000);
            return Err(refuse(Class::LimitExceeded, &asked, "an hour at most; ask again while you look"));
        }
        let core = self.shared.locked();
        let sources: Vec<SourceId> = match source {
            None => core.registry.sources.values().copied().collect(),
            Some(name) => {
                vec![*core.registry.sources.get(name).ok_or_else(|| unknown("interrupt source", name, core.registry.sources.keys().map(String::as_str)))?]
            }
        };
        sources.into_iter().for_each(|source| core.host.probe(source, for_ns));
        Ok(())
    }
}

/// Returns the blocks of each source that were visited since they were installed.
pub(crate) fn by_source(shared: &SystemState) -> HashMap<SourceId, Vec<BlockTimes>> {
    let mut found: HashMap<SourceId, Vec<BlockTimes>> = HashMap::new();
    let ids: Vec<u64> = shared.locked().instances.keys().copied().collect();
    for id in ids {
        // One instance at a time: no command waits until all have been read.
        let core = shared.locked();
        let Some(instance) = core.instances.get(&id) else { continue };
        let installed = &instance.installed;
        for (planned, (block, source)) in instance.plan.blocks.iter().zip(installed.blocks.iter().zip(&installed.block_source)) {
            let times = core.host.block_times(*source, block);
            if times.samples > 0 {
                found.entry(*source).or_default().push(BlockTimes {
                    instance: instance.name.clone(),
                    label: planned.label.clone(),
                    block: planned.block.clone(),
                    samples: times.samples,
                    last_ns: times.last_ns,
                    mean_ns: times.sum_ns as f64 / times.samples as f64,
                    max_ns: times.max_ns,
                    number: times.number,
                });
            }
        }
    }
    found
}
