// SPDX-License-Identifier: Apache-2.0
//! How long blocks take: what the kernels' probes have seen, for whoever looks.
use crate::core::Core;
use crate::refuse::{refuse, unknown};
use crate::system::System;
use kernel::SourceId;
use model::refusal::{Class, Refusals};
use serde_json::{Value as Json, json};
use std::collections::HashMap;

/// Who looks asks again before it is over; so nobody leaves a probe behind for longer.
pub const PROBE_MAX_NS: u64 = 3_600_000_000_000;

impl System {
    /// Lets a probe visit the blocks of a source, or of all sources, one a firing, for `for_ns` of real time from now on. Several
    /// who look add nothing to one. It changes nothing that is computed, and costs three readings of the clock a firing.
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
            None => core.sources.values().copied().collect(),
            Some(name) => vec![*core.sources.get(name).ok_or_else(|| unknown("interrupt source", name, core.sources.keys().map(String::as_str)))?],
        };
        sources.into_iter().for_each(|source| core.host.probe(source, for_ns));
        Ok(())
    }
}

/// Of each source the blocks that were visited since they were installed.
pub(crate) fn by_source(core: &Core) -> HashMap<SourceId, Vec<Json>> {
    let mut found: HashMap<SourceId, Vec<Json>> = HashMap::new();
    for instance in core.instances.values() {
        let installed = &instance.installed;
        for (planned, (block, source)) in instance.plan.blocks.iter().zip(installed.blocks.iter().zip(&installed.block_source)) {
            let times = core.host.block_times(*source, block);
            if times.samples > 0 {
                found.entry(*source).or_default().push(json!({
                    "instance": instance.name, "label": planned.label, "block": planned.block, "samples": times.samples,
                    "last_ns": times.last_ns, "mean_ns": times.sum_ns as f64 / times.samples as f64, "max_ns": times.max_ns, "number": times.number,
                }));
            }
        }
    }
    found
}
