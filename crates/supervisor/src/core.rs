// SPDX-License-Identifier: Apache-2.0
//! State that the supervisor keeps about a running system, under one lock, divided into parts by subject; each part owns its fields.
use crate::instances::table::Instances;
use crate::movements::carrier::Carrier;
use crate::numbers::Numbers;
use crate::observation::rings::Observables;
use crate::observation::state::Observation;
use crate::observation::taps::Taps;
use crate::processors::remote::Remote;
use crate::registry::Registry;
use crate::scripts::{Purpose, Scripts};
use crate::stopping::safety::Safety;
use crate::wiring::tables::Wiring;
use kernel::{Op, SourceId};
use runtime::Host;
use std::sync::Arc;

pub(crate) struct Core {
    pub host: Arc<Host>,
    pub registry: Registry,
    pub wiring: Wiring,
    pub instances: Instances,
    pub safety: Safety,
    pub observation: Observation,
    pub remote: Remote,
    pub scripts: Scripts,
    pub numbers: Numbers,
}

impl Core {
    pub fn new(host: Arc<Host>) -> Core {
        Core {
            host,
            registry: Registry::default(),
            wiring: Wiring::default(),
            instances: Instances::default(),
            safety: Safety::default(),
            observation: Observation::default(),
            remote: Remote::default(),
            scripts: Scripts::default(),
            numbers: Numbers::default(),
        }
    }

    /// Returns the carrier for movements.
    pub fn carrier(&mut self) -> Carrier<'_> {
        Carrier {
            host: &self.host,
            registry: &mut self.registry,
            wiring: &mut self.wiring,
            instances: &mut self.instances,
            scripts: &mut self.scripts,
            numbers: &mut self.numbers,
            taps: &self.observation.taps,
            recorded: &mut self.observation.recorded,
            lost: &self.safety.lost,
            cut_off: &self.safety.cut_off,
        }
    }

    /// Returns the taps, and the observable items.
    pub fn taps(&mut self) -> (&mut Taps, Observables<'_>) {
        let seen = Observables { registry: &self.registry, instances: &self.instances, is_virtual: self.host.is_virtual() };
        (&mut self.observation.taps, seen)
    }

    /// Replaces the rings of the sources in which an observed item was added, removed, or assigned another writer. Returns the sources
    /// whose tables change.
    pub fn renew_taps(&mut self) -> Vec<SourceId> {
        let (taps, seen) = self.taps();
        taps.renew(&seen)
    }

    /// Sends operations to a source as one script.
    pub fn submit(&mut self, source: SourceId, ops: Vec<Op>, purpose: Purpose) {
        self.carrier().submit(source, ops, purpose);
    }
}
