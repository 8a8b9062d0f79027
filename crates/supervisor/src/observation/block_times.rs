// SPDX-License-Identifier: Apache-2.0
//! Durations of blocks as measured by the kernels' probes.
use crate::refuse::{refuse, unknown};
use crate::system::{System, SystemState};
use kernel::SourceId;
use model::refusal::{Class, Refusals};
use serde::Serialize;
use std::collections::HashMap;

/// Maximum duration of a probe. An observer must renew the probe in time; an abandoned probe ends after this time at the latest.
pub const PROBE_MAX_NS: u64 = 3_600_000_000_000;

/// Durations of a block's invocations, as measured by a probe.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BlockTimes {
    /// Verb instance.
    pub instance: String,
    /// Label of the block; in a nested graph, `outer.inner.block`.
    pub label: String,
    /// Function block, as `module.block`.
    pub block: String,
    /// Number of invocations measured.
    pub samples: u64,
    /// Duration of the most recently measured invocation, ns.
    pub last_ns: u64,
    /// Mean duration, ns.
    pub mean_ns: f64,
    /// Maximum duration, ns.
    pub max_ns: u64,
    /// Number of the most recently measured invocation.
    pub number: u64,
}

impl System {
    /// Starts a probe that measures the blocks of a source, or of all sources, one per firing, for the next `for_ns` of real time.
    /// Several observers cost no more than one. The probe does not affect any computation, and costs three clock readings per firing.
    ///
    /// # Errors
    /// Fails if the source does not exist or the time exceeds an hour.
    pub fn probe(&self, source: Option<&str>, for_ns: u64) -> Result<(), Refusals> {
        if for_ns > PROBE_MAX_NS {
            let asked = format!("block times cannot be measured for {} s", for_ns / 1_000_000_000);
            return Err(refuse(Class::LimitExceeded, &asked, "request at most one hour, and repeat the request as long as you need them"));
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

/// Returns the durations of the blocks' invocations that have been measured since each block was installed, by source.
pub(crate) fn by_source(shared: &SystemState) -> HashMap<SourceId, Vec<BlockTimes>> {
    let mut found: HashMap<SourceId, Vec<BlockTimes>> = HashMap::new();
    let ids: Vec<u64> = shared.locked().instances.keys().copied().collect();
    for id in ids {
        // Lock for one instance at a time, so that no command waits for all of them.
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
