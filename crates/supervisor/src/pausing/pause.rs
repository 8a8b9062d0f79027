// SPDX-License-Identifier: Apache-2.0
//! Pause of a program. Every action on devices is suspended, and the devices' own verbs continue. New starts are held back: they take
//! their claims and inputs, but begin only when the pause ends.
//!
//! A pause applies to the whole system or to some logical devices. An instance suspended by a pause resumes when no pause applies to it
//! any longer; an instance suspended by a call stays suspended.
use crate::instances::instance::{Instance, Life};
use crate::observation::states::PausesInForce;
use model::plan::Target;
use std::collections::{BTreeMap, BTreeSet};

/// Pauses in force, and the instances that they stopped.
#[derive(Default)]
pub(crate) struct Pause {
    pub all: bool,
    pub devices: BTreeSet<String>,
    /// Instances that a pause has suspended or is suspending.
    pub suspended: BTreeSet<u64>,
    /// Instances started during a pause, with the values of their ψ.
    pub held_back: BTreeMap<u64, Vec<(Target, Vec<u8>)>>,
}

impl Pause {
    /// Clears all pauses after the emergency stop has ended them.
    pub fn clear(&mut self) {
        (self.all, self.devices) = (false, BTreeSet::new());
    }

    /// Returns true if the start of the instance is held back by a pause.
    pub fn is_held_back(&self, id: u64) -> bool {
        self.held_back.contains_key(&id)
    }

    /// Removes an ended instance from the instances suspended by a pause.
    pub fn forget_suspended(&mut self, id: u64) {
        self.suspended.remove(&id);
    }

    /// Removes an ending instance from the instances that are held back.
    pub fn forget_start(&mut self, id: u64) {
        self.held_back.remove(&id);
    }

    /// Returns the pauses in force: `true`, `false`, or the list of paused devices.
    pub fn shown(&self) -> PausesInForce {
        if self.devices.is_empty() || self.all { PausesInForce::All(self.all) } else { PausesInForce::Devices(self.devices.iter().cloned().collect()) }
    }

    /// Holds a start back if a pause applies to it. The start already has its claims.
    pub fn hold_back(&mut self, instance: &mut Instance, stores: &[(Target, Vec<u8>)], now_ns: i64) -> bool {
        if !self.covers(instance) {
            return false;
        }
        self.held_back.insert(instance.id, stores.to_vec());
        instance.life = Life::Suspended { held: Vec::new() };
        instance.times.running.hold(now_ns);
        true
    }

    /// Returns true for an action on devices to which a pause applies.
    pub fn covers(&self, instance: &Instance) -> bool {
        instance.is_action() && (self.all || instance.plan.devices.iter().any(|device| self.devices.contains(device)))
    }
}
