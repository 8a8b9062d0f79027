// SPDX-License-Identifier: Apache-2.0
//! Stopping on the supervisor's side: the emergency stop and its reset, inputs that trip it, and the enabling switch.
use crate::alarms::causes::{alarm_emergency, alarm_reset};
use crate::core::Core;
use crate::pausing::modes::Mode;
use crate::refuse::{invalid_state, refuse};
use crate::registry::DeviceState;
use crate::scripts::Purpose;
use device::Direction;
use kernel::Op;
use model::SystemCondition;
use model::refusal::{Class, Refusals};
use std::collections::HashSet;
use std::sync::atomic::Ordering;

/// Ends every action, brings the devices to their safe state, and latches. If the stop is already latched, records a further cause.
/// `source` is the input that tripped it, or `system`.
pub(crate) fn emergency_stop(core: &mut Core, source: &str, reason: &str) {
    let now_ns = core.host.now_ns();
    let reason = &*model::wording::printable(reason);
    core.observation.log.add(now_ns, "emergency_stop", source, reason);
    alarm_emergency(core, source, reason);
    core.safety.emergency.stop.store(true, Ordering::Release);
    core.host.stop_remote(true);
    if core.safety.emergency.reason.is_some() {
        return;
    }
    core.safety.emergency.reason = Some(reason.to_owned());
    core.safety.pause.clear();
    core.release_forces("the emergency stop", |_, _| true);
    safe_all(core);
    let (mut actions, servos): (Vec<u64>, Vec<u64>) = {
        let running = core.instances.values().filter(|i| i.is_busy());
        let (a, s): (Vec<_>, Vec<_>) = running.partition(|i| i.owner.is_none());
        (a.iter().map(|i| i.id).collect(), s.iter().map(|i| i.id).collect())
    };
    core.instances.queued_first(&mut actions);
    for id in actions.into_iter().chain(servos) {
        if let Some(owner) = core.instances.get(&id).and_then(|i| i.owner.clone()) {
            core.registry.set_device(&owner, DeviceState::Stopping);
        }
        core.course(id).end_now(SystemCondition::EmergencyStop, reason);
    }
    // For a device without a verb no end reports that it has stopped.
    for record in core.registry.logical.values_mut().filter(|r| r.instance.is_none() && r.state == DeviceState::Enabled) {
        record.state = DeviceState::Disabled;
    }
}

/// Sets every output to its safe value immediately, even if its source is not about to fire.
fn safe_all(core: &mut Core) {
    for (device, source) in core.registry.physical.values().map(|p| (p.device.clone(), p.source)).collect::<Vec<_>>() {
        let channels = (0..device.channels().len()).filter(|c| device.channels()[*c].direction == Direction::Write);
        let channels = channels.map(|c| u16::try_from(c).expect("a device has fewer than 65,536 channels")).collect();
        core.submit(source, vec![Op::Safe { device, channels }], Purpose::Nothing);
    }
}

/// Releases the latch and restarts the sources that were stopped by faults. Refuses while a cause is still present, and names it.
pub(crate) fn lift(core: &mut Core) -> Result<(), Refusals> {
    let present = core.safety.emergency.present(&core.registry);
    if !present.is_empty() {
        let present = present.join(", ");
        return Err(refuse(Class::EmergencyStopped, format!("cannot reset: the cause is still present ({present})"), "remove it first"));
    }
    if let Some(busy) = core.instances.values().find(|i| i.is_busy() && core.safety.emergency.reason.is_some()) {
        return Err(invalid_state(&format!("'{}'", busy.name), "still ending", "reset before the end of", "wait for it"));
    }
    core.safety.emergency.reason = None;
    for input in &mut core.safety.emergency.inputs {
        input.told = false;
        core.registry.physical[&input.device].device.forget(input.channel);
    }
    core.safety.emergency.stop.store(false, Ordering::Release);
    core.host.stop_remote(false);
    alarm_reset(core);
    core.safety.poisoned.clear();
    // Everything lost with a source that was only unresponsive is available again with it.
    let (gone, silent): (HashSet<_>, HashSet<_>) = core.safety.lost.drain().partition(|source| core.safety.ended_for_good.contains_key(source));
    core.safety.lost = gone;
    for physical in core.registry.physical.values_mut().filter(|physical| silent.contains(&physical.source) && !physical.device.is_lost()) {
        physical.lost = None;
    }
    let stopped: Vec<_> = core.registry.sources.values().copied().filter(|s| core.host.statistics(*s).stopped).collect();
    for source in stopped {
        core.host.restart(source);
    }
    for record in core.registry.logical.values_mut().filter(|r| r.state == DeviceState::Fault) {
        record.state = DeviceState::Disabled;
    }
    Ok(())
}

/// Handles inputs read by the kernels: every input that has tripped since the last reset is recorded as a cause.
pub(crate) fn watch_inputs(core: &mut Core) {
    for index in 0..core.safety.emergency.inputs.len() {
        let input = &core.safety.emergency.inputs[index];
        if !input.told && core.registry.physical[&input.device].device.asked(input.channel) {
            let (source, reason) = (input.channel_name(&core.registry), input.name(&core.registry));
            core.safety.emergency.inputs[index].told = true;
            emergency_stop(core, &source, &reason);
        }
    }
    watch_enabling_switch(core);
}

/// Ends the actions in manual mode when the switch is released.
pub(crate) fn watch_enabling_switch(core: &mut Core) {
    if core.safety.modes.mode != Mode::Manual {
        return;
    }
    let Some((false, name)) = core.safety.modes.enabling_switch(&core.registry) else { return };
    core.release_forces(&format!("enabling switch '{name}' was released"), |_, force| force.is_output);
    let actions: Vec<u64> =
        core.instances.values().filter(|i| i.is_busy() && !i.is_ending() && i.leaving.departure.is_none() && i.is_action()).map(|i| i.id).collect();
    for id in actions {
        core.course(id).end_by(SystemCondition::Aborted, format!("enabling switch '{name}' was released"));
    }
}

/// Changes the mode; refuses while an action on devices is running, and names it.
pub(crate) fn set_mode(core: &mut Core, mode: Mode) -> Result<(), Refusals> {
    if core.safety.modes.mode == mode {
        return Ok(());
    }
    if let Some(action) = core.instances.values().find(|i| i.is_busy() && i.is_action()) {
        let (name, to) = (&action.name, mode.word());
        return Err(refuse(Class::InvalidState, format!("cannot change to {to} mode: '{name}' is {}", action.state().name()), format!("halt '{name}' first")));
    }
    core.safety.modes.mode = mode;
    core.observation.log.add(core.host.now_ns(), "mode", "system", mode.word());
    Ok(())
}
