// SPDX-License-Identifier: Apache-2.0
//! Idle values of driving outputs. Outputs take them when their verb is suspended, and SVVs also when it ends.
use crate::instances::table::Instances;
use crate::refuse::refuse;
use crate::registry::Registry;
use crate::svvs::cells::SvvRecord;
use kernel::{Device, SourceId};
use model::idle::driving;
use model::plan::{CellKind, Claim, Plan, PlannedSuspend};
use model::refusal::{Class, Refusals};
use std::sync::Arc;

/// Returns the driving channels among those that a verb writes in a source.
pub(crate) fn idle_channels(registry: &Registry, plan: &Plan, source: SourceId) -> Vec<(Arc<Device>, Vec<u16>)> {
    let mut found: Vec<(&str, Vec<u16>)> = Vec::new();
    for (device, channel) in driving_channels(registry, plan).filter(|(device, _)| registry.physical[*device].source == source) {
        let channel = u16::try_from(channel).expect("a device has fewer than 65,536 channels");
        match found.iter_mut().find(|(name, _)| *name == device) {
            Some((_, channels)) => channels.push(channel),
            None => found.push((device, vec![channel])),
        }
    }
    found.into_iter().map(|(name, channels)| (registry.physical[name].device.clone(), channels)).collect()
}

fn driving_channels<'a>(registry: &'a Registry, plan: &'a Plan) -> impl Iterator<Item = (&'a str, usize)> {
    plan.claims.iter().filter_map(|claim| {
        let Claim::Channel { device, channel } = claim else { return None };
        driving(&registry.physical[device].device.channels()[*channel].unit).map(|_| (device.as_str(), *channel))
    })
}

/// Returns the driving SVVs that a verb writes, with their idle values. These are SVVs that a device's own verb reads as commands, that
/// have the unit of a driving quantity, and whose initial value is 0. An SVV with a different initial value is a limit, such as the
/// maximum force of a gripper, which would otherwise drop its load.
pub(crate) fn idle_svvs(registry: &Registry, instances: &Instances, plan: &Plan) -> Vec<(String, Vec<u8>)> {
    let written = plan.claims.iter().filter_map(|claim| if let Claim::Svv { name, .. } = claim { Some(name) } else { None });
    let begins_at_rest = |svv: &SvvRecord| driving(&svv.unit).is_some() && svv.first.iter().all(|byte| *byte == 0);
    let drives = |name: &&String| registry.svvs.get(*name).is_some_and(begins_at_rest) && commands_a_device(instances, name);
    written.filter(drives).map(|name| (name.clone(), registry.svvs[name].first.clone())).collect()
}

/// Returns true if some device's own verb reads an SVV and does not write it.
fn commands_a_device(instances: &Instances, name: &str) -> bool {
    instances.values().filter(|instance| instance.owner.is_some()).any(|instance| {
        let mut cells = instance.plan.cells.iter().filter(|cell| matches!(&cell.kind, CellKind::Svv { name: of, .. } if of == name));
        cells.any(|cell| !cell.readers.is_empty() && cell.writers.is_empty())
    })
}

/// Refuses a verb that declares that it holds its last commands, if one of its outputs is a driving output.
pub(crate) fn check_hold(registry: &Registry, instances: &Instances, plan: &Plan) -> Result<(), Refusals> {
    if plan.suspend != PlannedSuspend::Hold {
        return Ok(());
    }
    let channel = driving_channels(registry, plan).next().map(|(device, channel)| {
        let of = &registry.physical[device].device.channels()[channel];
        (format!("channel '{device}.{}'", of.name), of.unit.clone())
    });
    let svv = || idle_svvs(registry, instances, plan).into_iter().next().map(|(name, _)| (format!("SVV '{name}'"), registry.svvs[&name].unit.clone()));
    let Some((output, unit)) = channel.or_else(svv) else { return Ok(()) };
    let quantity = driving(&unit).unwrap_or("value");
    Err(refuse(
        Class::DefinitionError,
        format!("verb '{}' has suspend='hold', but it writes {output} in {unit}: a machine does not stand still under a constant {quantity}", plan.verb),
        "leave suspend= out, so that such outputs take their idle values; or write suspend='hold_last' if they are to keep their last values",
    ))
}
