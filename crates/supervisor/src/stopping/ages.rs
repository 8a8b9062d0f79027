// SPDX-License-Identifier: Apache-2.0
//! Limits on the age of values from other sources: `late` if a ratio value has been absent for longer, `link_lost` if nothing has arrived
//! from a timer, which publishes in each of its firings.
use crate::claims::writers::Pair;
use crate::core::Core;
use crate::instances::instance::Instance;
use crate::refuse::refuse;
use crate::wiring::ports::mode_of;
use kernel::SourceId;
use model::SystemCondition;
use model::interface::Mode;
use model::plan::CellKind;
use model::refusal::{Class, Refusals};

/// A value that is about to exceed its age limit.
struct Aging {
    condition: SystemCondition,
    /// Time at which the value will exceed its limit, ns on the clock: just after the limit, after the firings of that instant.
    over_ns: i64,
    pair: Pair,
}

/// Returns the time at which a value read by an instance will exceed its age limit if no new value arrives.
pub(crate) fn age_deadline(core: &Core, instance: &Instance) -> Option<i64> {
    instance.times.limits.age_max_ns?;
    aging(core, instance).map(|aging| aging.over_ns).min()
}

/// Returns the instances that read a value that has exceeded its age limit, each with the ending condition and the reason.
pub(crate) fn too_old(core: &Core, now_ns: i64) -> Vec<(u64, SystemCondition, String)> {
    let limited = core.instances.values().filter(|i| i.is_running() && i.times.limits.age_max_ns.is_some());
    let over = limited.filter_map(|i| Some((i, aging(core, i).find(|aging| aging.over_ns <= now_ns)?)));
    over.map(|(instance, Aging { condition, pair: (writer, reader), .. })| {
        let limit_s = instance.times.limits.age_max_ns.unwrap_or_default() as f64 * 1e-9;
        let (writer, reader) = (core.registry.source_name(writer), core.registry.source_name(reader));
        let message = match condition {
            SystemCondition::Late => format!("a ratio value from '{writer}' to '{reader}' has been missing for more than {limit_s} s"),
            _ => format!("no value from '{writer}' has arrived at '{reader}' for more than {limit_s} s"),
        };
        (instance.id, condition, message)
    })
    .collect()
}

/// Checks that an age limit leaves the writers enough time to publish.
pub(crate) fn check_age(core: &Core, instance: &Instance, age_max_ns: Option<i64>) -> Result<(), Refusals> {
    let Some(age_max_ns) = age_max_ns else { return Ok(()) };
    let slowest = heard(core, instance).into_iter().filter_map(|(writer, _)| Some((core.host.period_ns(writer)?, writer))).max();
    match slowest.filter(|(period_ns, _)| age_max_ns <= *period_ns) {
        None => Ok(()),
        Some((period_ns, writer)) => Err(refuse(
            Class::ValueRefused,
            format!(
                "cannot start '{}' with age_max {} s: source '{}', which it reads, publishes every {} s",
                instance.name,
                age_max_ns as f64 * 1e-9,
                core.registry.source_name(writer),
                period_ns as f64 * 1e-9
            ),
            "give a longer age",
        )),
    }
}

fn aging<'a>(core: &'a Core, instance: &'a Instance) -> impl Iterator<Item = Aging> + 'a {
    let age_max_ns = instance.times.limits.age_max_ns;
    let silent = heard(core, instance).into_iter().filter_map(move |(writer, reader)| {
        let inlets = &core.wiring.tables[&reader].inlets;
        let inbound = &inlets.iter().find(|inlet| inlet.instance.is_none() && inlet.writer == writer)?.inbound;
        let brought_ns = inbound.brought_ns().unwrap_or(i64::MIN).max(instance.times.started_ns);
        Some(Aging { condition: SystemCondition::LinkLost, over_ns: brought_ns.saturating_add(age_max_ns?).saturating_add(1), pair: (writer, reader) })
    });
    let late = instance.installed.sources.iter().flat_map(move |&reader| {
        let own = core.wiring.tables[&reader].inlets.iter().filter(move |inlet| age_max_ns.is_some() && inlet.instance == Some(instance.id));
        own.filter_map(move |inlet| {
            let since_ns = inlet.inbound.late_since_ns()?.max(instance.times.started_ns);
            Some(Aging { condition: SystemCondition::Late, over_ns: since_ns.saturating_add(age_max_ns?).saturating_add(1), pair: (inlet.writer, reader) })
        })
    });
    silent.chain(late)
}

/// Returns the pairs of timers through which an instance reads values asynchronously.
fn heard(core: &Core, instance: &Instance) -> Vec<Pair> {
    let mut pairs: Vec<Pair> = core.wiring.crossings.get(&instance.id).into_iter().flatten().map(|(pair, _, _)| *pair).collect();
    for cell in &instance.plan.cells {
        let CellKind::Svv { name, .. } = &cell.kind else { continue };
        let Some(home) = core.registry.svvs.get(name).and_then(|svv| svv.home) else { continue };
        let readers = cell.readers.iter().filter(|(block, item)| mode_of(&instance.plan, *block, *item) == Mode::Asynchronous);
        pairs.extend(readers.map(|(block, _)| (home, instance.installed.block_source[*block])).filter(|(writer, reader)| writer != reader));
    }
    pairs.sort();
    pairs.dedup();
    let is_timer = |source: &SourceId| core.host.period_ns(*source).is_some();
    pairs.retain(|(writer, reader)| is_timer(writer) && is_timer(reader));
    pairs
}
