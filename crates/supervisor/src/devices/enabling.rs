// SPDX-License-Identifier: Apache-2.0
//! Logical devices at run time: enabling, disabling, and their parameters.
use crate::core::Core;
use crate::instances::course::Course;
use crate::instances::following_errors::{GAP_MAX, number};
use crate::instances::instance::{Limits, State};
use crate::refuse::invalid_state;
use crate::registry::DeviceState;
use crate::starting::opening::store_target;
use crate::starting::psi::{device_values, encode, named};
use indexmap::IndexMap;
use model::SystemCondition;
use model::configuration::Configuration;
use model::refusal::Refusals;

impl Core {
    /// Starts the device's own verb instance; a device without one is enabled immediately. Returns the instance, or 0 if there is none.
    pub fn enable(&mut self, device: &str, configuration: &Configuration) -> Result<u64, Refusals> {
        let record = self.registry.logical(device)?;
        match record.state {
            DeviceState::Enabled | DeviceState::Enabling => return Ok(record.instance.unwrap_or(0)),
            DeviceState::Stopping => return Err(invalid_state(&format!("device '{device}'"), "stopping", "enable", "wait until it is disabled")),
            DeviceState::Disabled | DeviceState::Fault => {}
        }
        self.safety.emergency.refuse("enable", device)?;
        let Some(instance) = record.instance else {
            self.registry.set_device(device, DeviceState::Enabled);
            return Ok(0);
        };
        let before = record.state;
        self.registry.set_device(device, DeviceState::Enabling);
        self.keep_gap_max(device, configuration);
        if let Err(refusals) = self.course(instance).start(&IndexMap::new(), Limits::default(), configuration) {
            self.registry.set_device(device, before);
            return Err(refusals);
        }
        self.tell_unguarded(instance);
        Ok(instance)
    }

    /// Logs, once per physical device in an instance's sources, that the device is not made safe if the process commanding it exits.
    fn tell_unguarded(&mut self, instance: u64) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get(&instance) else { return };
        for (name, physical) in &mut self.registry.physical {
            if !instance.installed.sources.contains(&physical.source) {
                continue;
            }
            if let Some(text) = physical.unguarded_news.take() {
                self.observation.log.add(now_ns, "guard", name, text);
            }
        }
    }

    /// Ends the verbs that use the device, then the device's own verb. Returns true if they have already ended.
    pub fn disable(&mut self, device: &str) -> Result<bool, Refusals> {
        let record = self.registry.logical(device)?;
        let instance = record.instance;
        if matches!(record.state, DeviceState::Disabled | DeviceState::Fault) {
            return Ok(true);
        }
        self.end_users(device, SystemCondition::DeviceDisabled, &format!("device '{device}' was disabled"));
        if self.instances.users(device) > 0 {
            return Ok(false);
        }
        let Some(instance) = instance else {
            self.registry.set_device(device, DeviceState::Disabled);
            return Ok(true);
        };
        if self.registry.logical[device].state != DeviceState::Stopping {
            self.registry.set_device(device, DeviceState::Stopping);
            self.release_idle_forces();
            self.course(instance).end_by(SystemCondition::DeviceDisabled, format!("device '{device}' was disabled"));
        }
        Ok(self.registry.logical[device].state == DeviceState::Disabled)
    }

    /// Winds down in order: halts the actions, then disables the devices. Returns true when no verb is running. `is_late` is true if the
    /// lists to which τ leads on `halted` have exceeded their time limit.
    pub fn wind_down(&mut self, is_late: bool) -> bool {
        let mut actions: Vec<u64> = (self.instances.values())
            .filter(|i| i.owner.is_none() && matches!(i.state(), State::Queued | State::Running | State::Suspended) && !i.is_ending())
            .filter(|i| is_late || !i.leaving.halting)
            .map(|i| i.id)
            .collect();
        self.instances.queued_first(&mut actions);
        for id in actions {
            if let Some(condition) = self.instances[&id].system(SystemCondition::Halted) {
                self.course(id).come(condition, "the system was closed".to_owned(), true);
            }
        }
        if self.instances.values().any(|i| i.owner.is_none() && i.is_busy()) {
            return false;
        }
        let devices: Vec<String> = self.registry.logical.keys().cloned().collect();
        for device in devices {
            // The device exists: it was just listed.
            let _done = self.disable(&device);
        }
        !self.instances.values().any(|i| i.is_busy())
    }
}

impl Course<'_> {
    /// Ends an instance immediately, without following τ or running an ending list.
    pub fn end_now(&mut self, condition: SystemCondition, message: &str) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get(&id) else { return };
        let Some(condition) = instance.system(condition) else { return };
        if instance.state() == State::Queued {
            return self.leave_queue(condition, message, false);
        }
        if instance.is_ending() || !self.take_process(true) {
            return;
        }
        self.end_at_once(crate::instances::cause::Cause {
            condition,
            block: None,
            value: None,
            message: message.to_owned(),
            time_ns: now_ns,
            asked_for: false,
        });
    }
}

/// Interval for checking limits if no events occur, ns.
const WATCH_NS: i64 = 5_000_000;

impl Core {
    /// Returns the latest time at which the supervisor must wake up.
    pub fn next_wake(&self, now_ns: i64) -> Option<i64> {
        let watches = self.instances.values().any(|i| i.state() == State::Running && i.times.limits.overruns.is_some());
        let watch = watches.then_some(now_ns + WATCH_NS);
        [self.next_deadline(), watch].into_iter().flatten().min()
    }
}

impl Core {
    /// Sets a tunable parameter of a device in every running instance whose ψ uses it, alone or together with other devices.
    pub fn tune(&mut self, device: &str, parameter: &str, configuration: &Configuration) -> Result<(), Refusals> {
        use model::plan::InputOrigin;
        let mut stores = Vec::new();
        for instance in self.instances.values().filter(|i| i.is_busy()) {
            for input in &instance.plan.inputs {
                let InputOrigin::DeviceParameter { devices, parameter: name } = &input.origin else { continue };
                if name == parameter
                    && input.tunable
                    && devices.iter().any(|of| of == device)
                    && let Some(value) = device_values(configuration, devices, parameter, &input.type_text)
                {
                    let bytes = encode(&input.type_text, &input.unit, &value).map_err(|r| vec![named(r, parameter)])?;
                    stores.extend(input.targets.iter().map(|t| (instance.id, t.clone(), bytes.clone())));
                }
            }
        }
        self.keep_gap_max(device, configuration);
        for (id, target, bytes) in stores {
            if let Some(request) = self.instances.queue.iter_mut().find(|request| request.id == id) {
                request.stores.iter_mut().filter(|(to, _)| *to == target).for_each(|(_, stored)| stored.clone_from(&bytes));
                continue;
            }
            let mut builder = crate::movements::sequence::Builder::default();
            store_target(&self.registry, &mut builder, &self.instances[&id], &target, &bytes);
            self.course(id).append_sequence(builder.finish());
        }
        Ok(())
    }

    /// Records the maximum lost time that a device allows.
    fn keep_gap_max(&mut self, device: &str, configuration: &Configuration) {
        if let Some(record) = self.registry.logical.get_mut(device) {
            record.gap_max_s = configuration.logical_devices.get(device).and_then(|of| number(of.parameters.get(GAP_MAX)?));
        }
    }
}
