// SPDX-License-Identifier: Apache-2.0
//! Pausing and resuming of a program.
use crate::core::Core;
use crate::instances::instance::{Instance, Life, Rest, State};
use crate::refuse::invalid_state;
use crate::starting::opening::opening;
use model::refusal::Refusals;

/// Pauses the actions on these logical devices, or all actions on devices. Returns the instances that this suspends.
pub(crate) fn pause_program(core: &mut Core, devices: Option<&[String]>) -> Result<Vec<u64>, Refusals> {
    for device in devices.unwrap_or_default() {
        core.registry.logical(device)?;
    }
    core.safety.emergency.refuse("pause", "the program")?;
    match devices {
        None => core.safety.pause.all = true,
        Some(devices) => core.safety.pause.devices.extend(devices.iter().cloned()),
    }
    // An instance that is already ending completes its end.
    let ends = |i: &Instance| i.is_ending() || i.leaving.departure.is_some();
    let runs = |i: &&Instance| i.state() == State::Running && !ends(i) && !i.is_coming_to_rest() && core.safety.pause.covers(i);
    let running: Vec<u64> = core.instances.values().filter(runs).map(|i| i.id).collect();
    for &id in &running {
        // A second pause finds instances that the first one is still suspending.
        if core.safety.pause.suspended.insert(id) {
            core.course(id).suspend()?;
        }
    }
    core.observation.log.add(core.host.now_ns(), "pause", &scope(devices), names(core, &running));
    Ok(running)
}

/// Ends a pause. Returns the instances that resume, and those whose held-back start begins.
pub(crate) fn resume_program(core: &mut Core, devices: Option<&[String]>) -> Result<Vec<u64>, Refusals> {
    for device in devices.unwrap_or_default() {
        core.registry.logical(device)?;
    }
    core.safety.emergency.refuse("resume", "the program")?;
    match devices {
        None => core.safety.pause.clear(),
        Some(devices) => core.safety.pause.devices.retain(|device| !devices.contains(device)),
    }
    let free = |id: &&u64| core.instances.get(id).is_none_or(|i| !core.safety.pause.covers(i));
    let going: Vec<u64> = core.safety.pause.suspended.iter().filter(free).copied().collect();
    let beginning: Vec<u64> = core.safety.pause.held_back.keys().filter(free).copied().collect();
    for &id in &going {
        core.course(id).go_on_after_pause();
    }
    for &id in &beginning {
        begin_after_pause(core, id);
    }
    let all = [going, beginning].concat();
    core.observation.log.add(core.host.now_ns(), "resume", &scope(devices), names(core, &all));
    Ok(all)
}

fn begin_after_pause(core: &mut Core, id: u64) {
    let Some(stores) = core.safety.pause.held_back.remove(&id) else { return };
    let now_ns = core.host.now_ns();
    let Some(instance) = core.instances.get_mut(&id) else { return };
    instance.life = Life::Running(Rest::Unasked);
    instance.times.running.go_on(now_ns);
    let opening = opening(&core.registry, &core.instances[&id], &stores);
    core.course(id).append_sequence(opening);
}

/// Refuses to resume a single instance of a paused program.
pub(crate) fn refuse_paused(core: &Core, id: u64) -> Result<(), Refusals> {
    match core.instances.get(&id).filter(|i| core.safety.pause.covers(i)) {
        Some(paused) => Err(invalid_state(&format!("'{}'", paused.name), "paused with the program", "resume", "resume the program where it was paused")),
        None => Ok(()),
    }
}

fn names(core: &Core, ids: &[u64]) -> String {
    ids.iter().filter_map(|id| Some(core.instances.get(id)?.name.as_str())).collect::<Vec<_>>().join(", ")
}

fn scope(devices: Option<&[String]>) -> String {
    devices.map_or_else(|| "system".to_owned(), |devices| devices.join(", "))
}
