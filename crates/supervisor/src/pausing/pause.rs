// SPDX-License-Identifier: Apache-2.0
//! The pause of a program: every action on devices is suspended, what keeps devices going runs on, and what is started meanwhile
//! is held back: it has its claims and its inputs, and begins when the pause is over.
//!
//! A pause is of the whole system or of some logical devices. What a pause suspended goes on when no pause covers it;
//! an instance that was suspended by a call stays suspended.
use crate::instances::instance::{Instance, Life};
use crate::observation::states::PausesInForce;
use model::plan::Target;
use std::collections::{BTreeMap, BTreeSet};

/// Pauses in force, and the instances that they stopped.
#[derive(Default)]
pub(crate) struct Pause {
    pub all: bool,
    pub devices: BTreeSet<String>,
    /// Instances that a pause suspended, or is about to.
    pub suspended: BTreeSet<u64>,
    /// Instances that were started under a pause, with the values of their ψ.
    pub held_back: BTreeMap<u64, Vec<(Target, Vec<u8>)>>,
}

impl Pause {
    /// Clears all pauses: the emergency stop has ended them.
    pub fn clear(&mut self) {
        (self.all, self.devices) = (false, BTreeSet::new());
    }

    /// Returns true if it is started, but has not begun.
    pub fn is_held_back(&self, id: u64) -> bool {
        self.held_back.contains_key(&id)
    }

    /// Forgets that a pause suspended the instance, as it has ended.
    pub fn forget_suspended(&mut self, id: u64) {
        self.suspended.remove(&id);
    }

    /// Forgets the start of an instance that ends: it is held back no more.
    pub fn forget_start(&mut self, id: u64) {
        self.held_back.remove(&id);
    }

    /// Returns `true`, `false`, or the devices that are paused.
    pub fn shown(&self) -> PausesInForce {
        if self.devices.is_empty() || self.all { PausesInForce::All(self.all) } else { PausesInForce::Devices(self.devices.iter().cloned().collect()) }
    }

    /// Holds a start back, where a pause covers it. What it claims is its own already.
    pub fn hold_back(&mut self, instance: &mut Instance, stores: &[(Target, Vec<u8>)], now_ns: i64) -> bool {
        if !self.covers(instance) {
            return false;
        }
        self.held_back.insert(instance.id, stores.to_vec());
        instance.life = Life::Suspended { held: Vec::new() };
        instance.times.running.hold(now_ns);
        true
    }

    /// Returns true for an action on devices that a pause is about.
    pub fn covers(&self, instance: &Instance) -> bool {
        instance.is_action() && (self.all || instance.plan.devices.iter().any(|device| self.devices.contains(device)))
    }
}
