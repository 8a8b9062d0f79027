// SPDX-License-Identifier: Apache-2.0
//! Drivers of an activation across instances: the current writers of the SVVs that drive its synchronous and ratio inputs. When another
//! instance starts to write an SVV, the SVV's followers are redirected to that instance, so a reader can outlive its writers.
use crate::registry::Registry;
use crate::wiring::installed::{Gate, InstalledPlan};
use crate::wiring::ports::mode_of;
use kernel::{Activation, BlockId, Due, Inbound, SourceId};
use model::interface::Mode;
use model::plan::{self, Plan};
use std::sync::Arc;

/// Returns the SVVs written by others that drive a block's synchronous inputs.
pub(crate) fn driving_svvs(plan: &Plan, block: usize) -> impl Iterator<Item = &str> {
    let external = plan.blocks[block].external_drivers.iter();
    external.filter(move |(item, _)| mode_of(plan, block, *item) == Mode::Synchronous).map(|(_, svv)| svv.as_str())
}

/// Returns the blocks on the same source that drive a block: those of its plan, and those of other instances.
pub(crate) fn step_drivers(plan: &Plan, installed: &InstalledPlan, block: usize, registry: &Registry) -> Vec<BlockId> {
    let source = installed.block_source[block];
    let inner = plan.blocks[block].drivers.iter().map(|driver| installed.blocks[*driver].id());
    let gated = |svv: &&str| installed.gates.iter().any(|gate| gate.activation == plan.blocks[block].activation && gate.svv.as_deref() == Some(*svv));
    let outer = driving_svvs(plan, block)
        .filter(|svv| !gated(svv))
        .filter_map(|svv| registry.driver_of(svv))
        .filter(|writer| writer.source == source)
        .map(|writer| writer.block);
    inner.chain(outer).collect()
}

/// Returns the rule by which an activation of a plan is due in the current system. The activations of the plan that drive it must already
/// exist.
pub(crate) fn due(registry: &Registry, plan: &Plan, activations: &[Arc<Activation>], gates: &[Gate], (index, source): (usize, SourceId)) -> Due {
    let own = |by: &[(usize, u32)]| -> Vec<(Arc<Activation>, u32)> { by.iter().map(|(driver, n)| (activations[*driver].clone(), *n)).collect() };
    match &plan.activations[index].due {
        plan::Due::Interval => Due::Interval,
        plan::Due::Driven { by } => Due::Driven { by: own(by) },
        plan::Due::Queued { by } => {
            let mut by = own(by);
            by.extend(outside(registry, plan, gates, (index, source)));
            let members: Vec<(Arc<Inbound>, usize)> =
                gates.iter().filter(|gate| gate.activation == index).map(|gate| (gate.inbound.clone(), gate.member)).collect();
            if members.is_empty() { Due::Driven { by } } else { Due::Queued { members, by } }
        }
    }
}

/// Returns the activations of other instances on the same source that drive this one; an SVV without a writer is represented by an
/// activation that is never active.
fn outside(registry: &Registry, plan: &Plan, gates: &[Gate], (activation, source): (usize, SourceId)) -> Vec<(Arc<Activation>, u32)> {
    let mut found: Vec<(Arc<Activation>, u32)> = Vec::new();
    for svv in plan.activations[activation].blocks.iter().flat_map(|block| driving_svvs(plan, *block)) {
        if gates.iter().any(|gate| gate.activation == activation && gate.svv.as_deref() == Some(svv)) {
            // The values arrive through a queue.
            continue;
        }
        match registry.driver_of(svv) {
            Some(writer) if writer.source == source => {
                if !found.iter().any(|(known, n)| Arc::ptr_eq(known, &writer.activation) && *n == writer.ratio) {
                    found.push((writer.activation.clone(), writer.ratio));
                }
            }
            Some(_) => {}
            None => found.push((Activation::new(Due::Interval, None), 1)),
        }
    }
    found
}
