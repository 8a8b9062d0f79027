// SPDX-License-Identifier: Apache-2.0
//! Lost processors: detects sources that do not acknowledge a script within their time limit. Verbs with blocks on such a source receive
//! `processor_lost`: they follow τ to a list that runs on the remaining sources, or end. Until a reset, no wait includes a lost source.
use crate::alarms::causes::alarm_processor;
use crate::core::Core;
use crate::instances::cause::Cause;
use crate::instances::instance::Instance;
use crate::observation::log::Log;
use crate::refuse::refuse;
use crate::registry::Registry;
use kernel::SourceId;
use model::SystemCondition;
use model::plan::Plan;
use model::refusal::{Class, Refusals};

/// Time limit for a source to answer a script, ns. An idle source answers immediately, a busy one after its firing, which may use its
/// entire declared time budget: see [`answer_ns`].
const ANSWER_NS: i64 = 4_000_000_000;
/// Grace period after this side has found an answer to be late, ns. If both sides were suspended, the first one to wake up must not
/// decide immediately.
const LAST_CALL_NS: i64 = 1_000_000_000;

/// Delay of a check above which this side is considered to have been suspended itself, ns.
const STOOD_STILL_NS: i64 = 250_000_000;

/// Marks a device as lost. If it is lost together with its processor, this has no further consequences, because the lost processor
/// already causes the alarm and the ends.
pub(crate) fn mark_lost(registry: &mut Registry, log: &mut Log, device: &str, message: &str, time_ns: i64) {
    log.add(time_ns, "device", device, format!("device '{device}' was lost: {message}"));
    if let Some(physical) = registry.physical.get_mut(device) {
        (physical.lost, physical.lost_ns) = (Some(message.to_owned()), time_ns);
    }
}

/// Returns the time limit for the answer of a source, ns. It is extended so that a block within its declared budget does not cause its
/// source to be considered lost.
fn answer_ns(core: &Core, source: SourceId) -> i64 {
    let budgets = core.instances.values().filter(|i| i.is_busy()).map(|i| i.budget_ns(source));
    ANSWER_NS.saturating_add(budgets.max().unwrap_or(0))
}

/// Returns the sources that have not answered yet, each with its deadline, which includes the grace period if that has started.
fn awaited(core: &Core) -> impl Iterator<Item = (SourceId, i64)> {
    let asking = core.instances.values().filter(|i| i.work.outstanding > 0);
    asking.flat_map(move |i| {
        i.work.awaited.iter().map(move |source| {
            let due_ns = i.work.last_call_ns.map_or_else(|| i.work.sent_ns.saturating_add(answer_ns(core, *source)), |called_ns| called_ns + LAST_CALL_NS);
            (*source, due_ns)
        })
    })
}

/// Returns the earliest deadline for an answer.
pub(crate) fn next_answer(core: &Core) -> Option<i64> {
    awaited(core).map(|(_, at)| at).min()
}

/// Declares sources lost if they have not answered in time.
pub(crate) fn look_for_lost(core: &mut Core) {
    let now_ns = core.host.now_ns();
    let Some(at) = next_answer(core).filter(|at| *at <= now_ns) else { return };
    let was_held_up = now_ns - at > STOOD_STILL_NS;
    let late: Vec<SourceId> = awaited(core).filter(|(_, at)| *at <= now_ns).map(|(source, _)| source).collect();
    // An answer that arrived while this side was held up too may still be waiting to be processed.
    let uncalled = |i: &Instance| i.work.outstanding > 0 && i.work.awaited.iter().any(|s| late.contains(s)) && (was_held_up || i.work.last_call_ns.is_none());
    let mut calls = false;
    for instance in core.instances.values_mut().filter(|i| uncalled(i)) {
        (instance.work.last_call_ns, calls) = (Some(now_ns), true);
    }
    if calls {
        return;
    }
    let mut silent = late;
    silent.sort_unstable();
    silent.dedup();
    silent.into_iter().for_each(|source| give_up(core, source));
}

fn give_up(core: &mut Core, source: SourceId) {
    let message = format!("source '{}' has not answered for {} s", core.registry.source_name(source), (answer_ns(core, source) + LAST_CALL_NS) / 1_000_000_000);
    processor_lost(core, source, &message);
}

/// Declares a source lost because it no longer runs or its processor cannot be reached.
pub(crate) fn processor_lost(core: &mut Core, source: SourceId, message: &str) {
    core.safety.ended_for_good.remove(&source);
    if !core.safety.lost.insert(source) {
        return;
    }
    let time_ns = core.host.now_ns();
    let name = core.registry.source_name(source).to_owned();
    let message = message.to_owned();
    core.observation.log.add(time_ns, "processor_lost", &name, message.clone());
    let place = core.remote.lost_place(&name);
    alarm_processor(core, &place, &message);
    let there: Vec<u64> = core.instances.values().filter(|i| i.is_busy() && i.installed.sources.contains(&source)).map(|i| i.id).collect();
    for id in there {
        if !core.course(id).take_process(true) {
            continue;
        }
        // Only now is the current list of the process certain.
        if let Some(condition) = core.instances.get(&id).and_then(|i| i.system(SystemCondition::ProcessorLost)) {
            core.course(id).lose(Cause { condition, block: None, value: None, message: message.clone(), time_ns, asked_for: false });
        }
    }
    let waiting: Vec<u64> = core.instances.values().filter(|i| i.work.awaited.contains(&source)).map(|i| i.id).collect();
    for id in waiting {
        if let Some(instance) = core.instances.get_mut(&id) {
            instance.work.awaited.retain(|awaited| *awaited != source);
            instance.work.outstanding = instance.work.awaited.len();
        }
        core.course(id).proceed();
    }
    let gone: Vec<String> = core.registry.physical.iter().filter(|(_, physical)| physical.source == source).map(|(name, _)| name.clone()).collect();
    gone.iter().for_each(|device| mark_lost(&mut core.registry, &mut core.observation.log, device, &message, time_ns));
}

/// Declares lost a source whose thread can neither continue until the program is restarted nor make its devices safe. Writes the safe
/// values that its devices registered for this case, as the guard would, and reports the outputs that remain unchanged.
pub(crate) fn give_up_for_good(core: &mut Core, source: SourceId, why: &str, time_ns: i64) {
    let commanded = core.registry.physical.iter().filter(|(_, physical)| physical.source == source && physical.device.is_commanded());
    let [mut safe, mut stay] = [Vec::new(), Vec::new()];
    for (name, physical) in commanded {
        let handles = physical.device.safe_handles();
        match handles.iter().try_for_each(guard::make_safe) {
            Ok(()) if handles.is_empty() => stay.push(format!("'{name}'")),
            Ok(()) => safe.push(format!("'{name}'")),
            Err(error) => stay.push(format!("'{name}' ({error})")),
        }
    }
    let mut message = why.to_owned();
    if !safe.is_empty() {
        message += &format!("; outputs were made safe: {}", safe.join(", "));
    }
    if !stay.is_empty() {
        message += &format!("; outputs stay as they are: {}", stay.join(", "));
    }
    let name = core.registry.source_name(source).to_owned();
    core.observation.log.add(time_ns, "fault", &name, message.clone());
    processor_lost(core, source, &message);
    core.safety.ended_for_good.insert(source, message);
}

/// Refuses a plan that uses a source on a lost processor.
pub(crate) fn refuse_lost_plan(core: &Core, plan: &Plan) -> Result<(), Refusals> {
    match plan.blocks.iter().filter_map(|block| core.registry.sources.get(&block.source)).find(|source| core.safety.lost.contains(source)) {
        None => Ok(()),
        Some(source) => {
            let remedy = if core.safety.ended_for_good.contains_key(source) { "start the program again" } else { "call reset()" };
            let message = format!("cannot create '{}': source '{}' is lost", plan.verb, core.registry.source_name(*source));
            Err(refuse(Class::InvalidState, message, format!("see the log for the reason, then {remedy}")))
        }
    }
}
