// SPDX-License-Identifier: Apache-2.0
//! Table of all verb instances, including the start queue and the names.
use crate::instances::instance::{Instance, Limits};
use crate::refuse::invalid_state;
use crate::registry::{DeviceState, Registry};
use crate::starting::psi::InputValues;
use kernel::BlockId;
use model::plan::Target;
use model::refusal::Refusals;
use runtime::Host;
use std::collections::HashMap;
use std::collections::btree_map::{BTreeMap, Keys, Values, ValuesMut};
use std::ops::Index;

/// An accepted start with its encoded values.
pub(crate) struct Request {
    pub id: u64,
    pub stores: Vec<(Target, Vec<u8>)>,
    /// Values of the input parameters, effective when the start begins.
    pub inputs: InputValues,
    pub limits: Limits,
}

/// Instances by number.
#[derive(Default)]
pub(crate) struct Instances {
    by_number: BTreeMap<u64, Instance>,
    /// Starts waiting for claims, in order.
    pub queue: Vec<Request>,
    /// Number of instances named so far for each verb.
    named: HashMap<String, u64>,
}

impl Index<&u64> for Instances {
    type Output = Instance;

    fn index(&self, id: &u64) -> &Instance {
        &self.by_number[id]
    }
}

impl Instances {
    pub fn get(&self, id: &u64) -> Option<&Instance> {
        self.by_number.get(id)
    }

    pub fn get_mut(&mut self, id: &u64) -> Option<&mut Instance> {
        self.by_number.get_mut(id)
    }

    /// Returns an instance if it has not been deleted.
    pub fn known(&self, id: u64) -> Result<&Instance, Refusals> {
        self.get(&id).ok_or_else(|| invalid_state("the verb instance", "deleted", "use", "create a new one with new_instance(…)"))
    }

    /// Returns a name for the next instance of a verb: `move#1`, `move#2`, …
    pub fn next_name(&mut self, verb: &str) -> String {
        let count = self.named.entry(verb.to_owned()).or_default();
        loop {
            *count += 1;
            let name = format!("{verb}#{count}");
            if !self.by_number.values().any(|i| i.name == name) {
                return name;
            }
        }
    }

    pub fn contains_key(&self, id: &u64) -> bool {
        self.by_number.contains_key(id)
    }

    pub fn insert(&mut self, id: u64, instance: Instance) {
        self.by_number.insert(id, instance);
    }

    pub fn remove(&mut self, id: &u64) -> Option<Instance> {
        self.by_number.remove(id)
    }

    pub fn values(&self) -> Values<'_, u64, Instance> {
        self.by_number.values()
    }

    pub fn values_mut(&mut self) -> ValuesMut<'_, u64, Instance> {
        self.by_number.values_mut()
    }

    pub fn keys(&self) -> Keys<'_, u64, Instance> {
        self.by_number.keys()
    }

    /// Returns the instance to which an installed block belongs, and the index of the block in it.
    pub fn culprit(&self, block: BlockId) -> Option<(&Instance, usize)> {
        self.values().find_map(|i| Some((i, i.installed.blocks.iter().position(|b| b.id() == block)?)))
    }

    /// Returns the number of overruns so far in the sources of an instance.
    pub fn overruns(&self, host: &Host, id: u64) -> u64 {
        self[&id].installed.sources.iter().map(|s| host.statistics(*s).overruns).sum()
    }

    /// Returns the number of running instances that use a device.
    pub fn users(&self, device: &str) -> usize {
        self.values().filter(|i| i.is_busy() && i.plan.devices.iter().any(|d| d == device)).count()
    }

    /// Returns the state of a device: `disabled`, `enabling`, `standstill`, `moving`, `stopping` or `fault`.
    pub fn device_state(&self, registry: &Registry, device: &str) -> Result<&'static str, Refusals> {
        Ok(match registry.logical(device)?.state {
            DeviceState::Disabled => "disabled",
            DeviceState::Enabling => "enabling",
            DeviceState::Enabled if self.users(device) > 0 => "moving",
            DeviceState::Enabled => "standstill",
            DeviceState::Stopping => "stopping",
            DeviceState::Fault => "fault",
        })
    }
}
