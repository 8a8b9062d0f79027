// SPDX-License-Identifier: Apache-2.0
//! Logical devices as they run: enable, disable, their parameters.
use crate::core::{Core, DeviceState, LogicalRecord};
use crate::instance::{Limits, State};
use crate::refuse::{invalid_state, unknown};
use indexmap::IndexMap;
use model::configuration::Configuration;
use model::refusal::Refusals;

impl Core {
    pub fn logical(&self, device: &str) -> Result<&LogicalRecord, Refusals> {
        self.logical.get(device).ok_or_else(|| unknown("logical device", device, self.logical.keys().map(String::as_str)))
    }

    /// Starts the device's own verb instance; without one it is enabled at once. The instance, or 0.
    pub fn enable(&mut self, device: &str, configuration: &Configuration) -> Result<u64, Refusals> {
        let record = self.logical(device)?;
        match record.state {
            DeviceState::Enabled | DeviceState::Enabling => return Ok(record.instance.unwrap_or(0)),
            DeviceState::Stopping => return Err(invalid_state(&format!("device '{device}'"), "stopping", "enable", "wait until it is disabled")),
            DeviceState::Disabled | DeviceState::Fault => {}
        }
        self.refuse_emergency("enable", device)?;
        let Some(instance) = record.instance else {
            self.set_device(device, DeviceState::Enabled);
            return Ok(0);
        };
        let before = record.state;
        self.set_device(device, DeviceState::Enabling);
        if let Err(refusals) = self.start(instance, &IndexMap::new(), Limits::default(), configuration) {
            self.set_device(device, before);
            return Err(refusals);
        }
        Ok(instance)
    }

    /// Ends the verbs that use it, then its own. True when it is done already.
    pub fn disable(&mut self, device: &str) -> Result<bool, Refusals> {
        let record = self.logical(device)?;
        let instance = record.instance;
        if matches!(record.state, DeviceState::Disabled | DeviceState::Fault) {
            return Ok(true);
        }
        self.end_users(device, "device_disabled", &format!("device '{device}' was disabled"));
        if self.users(device) > 0 {
            return Ok(false);
        }
        let Some(instance) = instance else {
            self.set_device(device, DeviceState::Disabled);
            return Ok(true);
        };
        if self.logical[device].state != DeviceState::Stopping {
            self.set_device(device, DeviceState::Stopping);
            self.end_by_name(instance, "device_disabled", format!("device '{device}' was disabled"));
        }
        Ok(self.logical[device].state == DeviceState::Disabled)
    }

    pub(crate) fn set_device(&mut self, device: &str, state: DeviceState) {
        if let Some(record) = self.logical.get_mut(device) {
            record.state = state;
        }
    }

    /// Running instances that use a device.
    fn users(&self, device: &str) -> usize {
        self.instances.values().filter(|i| i.is_busy() && i.plan.devices.iter().any(|d| d == device)).count()
    }

    /// disabled, enabling, standstill, moving, stopping, fault.
    pub fn device_state(&self, device: &str) -> Result<&'static str, Refusals> {
        Ok(match self.logical(device)?.state {
            DeviceState::Disabled => "disabled",
            DeviceState::Enabling => "enabling",
            DeviceState::Enabled if self.users(device) > 0 => "moving",
            DeviceState::Enabled => "standstill",
            DeviceState::Stopping => "stopping",
            DeviceState::Fault => "fault",
        })
    }

    /// Ends an instance without asking τ.
    pub fn end_now(&mut self, id: u64, condition: &str, message: &str) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get(&id) else { return };
        let Some(condition) = instance.condition(condition) else { return };
        if instance.ending.is_some() || !self.take_process(id, true) {
            return;
        }
        self.end(id, crate::instance::Cause { condition, block: None, value: None, message: message.to_owned(), time_ns: now_ns, asked_for: false });
    }

    /// Halts the actions, then disables the devices: the orderly end. True when nothing runs any more. `is_late`: what τ does with
    /// `halted` has had its time.
    pub fn wind_down(&mut self, is_late: bool) -> bool {
        let actions: Vec<u64> = (self.instances.values())
            .filter(|i| i.owner.is_none() && matches!(i.state, State::Running | State::Suspended) && i.ending.is_none())
            .filter(|i| is_late || !i.halting)
            .map(|i| i.id)
            .collect();
        for id in actions {
            if let Some(condition) = self.instances[&id].condition("halted") {
                self.come(id, condition, "the system was closed".to_owned(), true);
            }
        }
        if self.instances.values().any(|i| i.owner.is_none() && i.is_busy()) {
            return false;
        }
        let devices: Vec<String> = self.logical.keys().cloned().collect();
        for device in devices {
            // A device of that name is there: it was listed just now.
            let _done = self.disable(&device);
        }
        !self.instances.values().any(|i| i.is_busy())
    }
}

/// How often limits are looked at where no event would bring them, ns.
const WATCH_NS: i64 = 5_000_000;

impl Core {
    /// When the supervisor has to wake up at the latest.
    pub fn next_wake(&self, now_ns: i64) -> Option<i64> {
        let watches = self.instances.values().any(|i| i.state == State::Running && i.limits.overruns.is_some());
        let watch = watches.then_some(now_ns + WATCH_NS);
        [self.next_deadline(), watch].into_iter().flatten().min()
    }
}

impl Core {
    /// A tunable parameter of a device, in every running instance whose ψ takes it.
    pub fn tune(&mut self, device: &str, parameter: &str, value: &model::value::Value) -> Result<(), Refusals> {
        use model::plan::InputOrigin;
        let mut stores = Vec::new();
        for instance in self.instances.values().filter(|i| i.is_busy()) {
            for input in &instance.plan.inputs {
                let InputOrigin::DeviceParameter { devices, parameter: name } = &input.origin else { continue };
                if name == parameter && input.tunable && devices.as_slice() == [device] {
                    let bytes = crate::life::encode(&input.type_text, &input.unit, value).map_err(|r| vec![crate::life::named(r, parameter)])?;
                    stores.extend(input.targets.iter().map(|t| (instance.id, t.clone(), bytes.clone())));
                }
            }
        }
        for (id, target, bytes) in stores {
            let mut builder = crate::sequence::Builder::default();
            self.store_target(&mut builder, &self.instances[&id], &target, &bytes);
            self.append_sequence(id, builder.finish());
        }
        Ok(())
    }
}
