// SPDX-License-Identifier: Apache-2.0
//! What runs when the programming system that started it is cut off: each instance follows the word `if_cut_off` of its verb.
use crate::core::{Core, DeviceState};
use crate::instance::Instance;
use crate::system::System;
use model::definition::IfCutOff;
use model::refusal::Refusals;

impl Instance {
    /// What it does: as its verb says; else an action is halted, and what keeps a device going continues.
    pub fn if_cut_off(&self) -> IfCutOff {
        self.plan.if_cut_off.unwrap_or(if self.owner.is_some() { IfCutOff::Continue } else { IfCutOff::Halt })
    }
}

impl Core {
    /// Applies the policies, the quickest first: what must be safe does not wait behind what may be halted in order.
    fn abandon(&mut self, instances: &[u64], who: &str) {
        let now_ns = self.host.now_ns();
        let message = format!("programming system '{who}' was cut off");
        self.log.add(now_ns, "cut_off", who, format!("{} instances", instances.len()));
        let mut busy: Vec<u64> = instances.iter().copied().filter(|id| self.instances.get(id).is_some_and(Instance::is_busy)).collect();
        self.queued_first(&mut busy);
        let with = |core: &Core, policy: IfCutOff| -> Vec<u64> { busy.iter().copied().filter(|id| core.instances[id].if_cut_off() == policy).collect() };
        let (safe, halt) = (with(self, IfCutOff::Safe), with(self, IfCutOff::Halt));
        safe.into_iter().for_each(|id| self.make_safe(id, &message));
        halt.into_iter().for_each(|id| self.halt_abandoned(id, &message));
    }

    /// The instance and what its devices do end at once, their outputs safe.
    fn make_safe(&mut self, id: u64, message: &str) {
        let Some(instance) = self.instances.get(&id) else { return };
        let devices: Vec<String> = instance.owner.iter().chain(&instance.plan.devices).cloned().collect();
        if instance.owner.is_none() {
            self.end_now(id, "aborted", message);
        }
        for device in devices {
            if let Some(own) = self.stopping(&device) {
                self.end_now(own, "aborted", message);
            }
            self.end_users(&device, "device_disabled", message);
        }
    }

    fn halt_abandoned(&mut self, id: u64, message: &str) {
        let Some(instance) = self.instances.get(&id) else { return };
        if let Some(device) = instance.owner.clone() {
            self.end_users(&device, "device_disabled", message);
            if let Some(own) = self.stopping(&device) {
                self.end_by_name(own, "device_disabled", message.to_owned());
            }
        } else if let Some(condition) = instance.condition("halted") {
            self.come(id, condition, message.to_owned(), false);
        }
    }

    /// An enabled device is to stop; the instance that keeps it going, if it has one.
    fn stopping(&mut self, device: &str) -> Option<u64> {
        let record = self.logical.get(device).filter(|record| matches!(record.state, DeviceState::Enabled | DeviceState::Enabling))?;
        let own = record.instance;
        self.set_device(device, if own.is_some() { DeviceState::Stopping } else { DeviceState::Disabled });
        own
    }
}

impl System {
    /// Whether an instance goes on when the programming system that started it is cut off. False for one that is not there.
    pub fn continues(&self, instance: u64) -> bool {
        self.shared.locked().instances.get(&instance).is_some_and(|instance| instance.if_cut_off() == IfCutOff::Continue)
    }

    /// Tells that the programming system `who`, which started these instances, is cut off: each that runs follows the word
    /// `if_cut_off` of its verb. Instances that have ended, or are not there any more, are passed over.
    pub fn abandon(&self, instances: &[u64], who: &str) -> Result<(), Refusals> {
        self.shared.command(|core| {
            core.abandon(instances, who);
            Ok(())
        })
    }
}
