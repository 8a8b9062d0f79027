// SPDX-License-Identifier: Apache-2.0
//! Reactions when the programming system that started instances is cut off: each instance follows the `if_cut_off` of its verb.
use crate::core::Core;
use crate::instances::instance::Instance;
use crate::registry::DeviceState;
use model::SystemCondition;
use model::definition::IfCutOff;

impl Instance {
    /// Returns the reaction of the instance: that of its verb or, by default, halting for an action and continuing for a device's own
    /// verb.
    pub fn if_cut_off(&self) -> IfCutOff {
        self.plan.if_cut_off.unwrap_or(if self.owner.is_some() { IfCutOff::Continue } else { IfCutOff::Halt })
    }
}

/// Applies the reactions, fastest first: devices that must be made safe do not wait for orderly halts.
pub(crate) fn abandon(core: &mut Core, instances: &[u64], who: &str) {
    let now_ns = core.host.now_ns();
    let message = format!("programming system '{who}' was cut off");
    core.observation.log.add(now_ns, "cut_off", who, format!("{} instances", instances.len()));
    let mut busy: Vec<u64> = instances.iter().copied().filter(|id| core.instances.get(id).is_some_and(Instance::is_busy)).collect();
    core.instances.queued_first(&mut busy);
    let with = |core: &Core, policy: IfCutOff| -> Vec<u64> { busy.iter().copied().filter(|id| core.instances[id].if_cut_off() == policy).collect() };
    let (safe, halt) = (with(core, IfCutOff::Safe), with(core, IfCutOff::Halt));
    safe.into_iter().for_each(|id| make_safe(core, id, &message));
    halt.into_iter().for_each(|id| halt_abandoned(core, id, &message));
}

/// Ends the instance and the motion of its devices immediately, with their outputs made safe.
fn make_safe(core: &mut Core, id: u64, message: &str) {
    let Some(instance) = core.instances.get(&id) else { return };
    let devices: Vec<String> = instance.owner.iter().chain(&instance.plan.devices).cloned().collect();
    if instance.owner.is_none() {
        core.course(id).end_now(SystemCondition::Aborted, message);
    }
    for device in devices {
        if let Some(own) = stopping(core, &device) {
            core.course(own).end_now(SystemCondition::Aborted, message);
        }
        core.end_users(&device, SystemCondition::DeviceDisabled, message);
    }
}

fn halt_abandoned(core: &mut Core, id: u64, message: &str) {
    let Some(instance) = core.instances.get(&id) else { return };
    if let Some(device) = instance.owner.clone() {
        core.end_users(&device, SystemCondition::DeviceDisabled, message);
        if let Some(own) = stopping(core, &device) {
            core.course(own).end_by(SystemCondition::DeviceDisabled, message.to_owned());
        }
    } else if let Some(condition) = instance.system(SystemCondition::Halted) {
        core.course(id).come(condition, message.to_owned(), false);
    }
}

/// Stops an enabled device; returns the instance of its own verb, if it has one.
fn stopping(core: &mut Core, device: &str) -> Option<u64> {
    let record = core.registry.logical.get(device).filter(|record| matches!(record.state, DeviceState::Enabled | DeviceState::Enabling))?;
    let own = record.instance;
    core.registry.set_device(device, if own.is_some() { DeviceState::Stopping } else { DeviceState::Disabled });
    own
}
