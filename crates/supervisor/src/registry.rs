// SPDX-License-Identifier: Apache-2.0
//! Records of the running system: interrupt sources, SVVs, physical and logical devices.
use crate::refuse::unknown;
use crate::svvs::cells::SvvRecord;
use device::Beside;
use indexmap::IndexMap;
use kernel::{Device, SourceId, SourceSpec};
use model::plan::Claim;
use model::refusal::Refusals;
use std::collections::HashMap;
use std::sync::Arc;

/// Registry of the configuration, as it runs.
#[derive(Default)]
pub(crate) struct Registry {
    /// `rtp.name` → source.
    pub sources: IndexMap<String, SourceId>,
    /// Specification of each source, by number.
    pub specs: Vec<SourceSpec>,
    pub svvs: IndexMap<String, SvvRecord>,
    /// Number of SVVs made so far: each has its number for the life of the system.
    pub svvs_made: u32,
    pub physical: IndexMap<String, PhysicalRecord>,
    pub logical: IndexMap<String, LogicalRecord>,
    /// Instance that has claimed it, and may write.
    pub claims: HashMap<Claim, u64>,
}

impl Registry {
    /// Returns `rtp.name` of a source.
    pub fn source_name(&self, source: SourceId) -> &str {
        self.sources.iter().find(|(_, id)| **id == source).map_or("?", |(name, _)| name)
    }

    pub fn logical(&self, device: &str) -> Result<&LogicalRecord, Refusals> {
        self.logical.get(device).ok_or_else(|| unknown("logical device", device, self.logical.keys().map(String::as_str)))
    }

    pub fn set_device(&mut self, device: &str, state: DeviceState) {
        if let Some(record) = self.logical.get_mut(device) {
            record.state = state;
        }
    }

    pub fn keep_with(&mut self, device: &str, instance: u64) {
        if let Some(record) = self.logical.get_mut(device) {
            record.instance = Some(instance);
        }
    }

    pub fn claim_name(&self, claim: &Claim) -> String {
        match claim {
            Claim::Svv { name, .. } => format!("SVV '{name}'"),
            Claim::Channel { device, channel } => {
                let name = self.physical.get(device).and_then(|p| p.device.channels().get(*channel).map(|c| c.name.clone()));
                format!("channel '{device}.{}'", name.unwrap_or_default())
            }
        }
    }

    /// Notes that a device which was being enabled is; returns false if it was not.
    pub fn note_ready(&mut self, device: &str) -> bool {
        let enabling = self.logical.get_mut(device).filter(|device| device.state == DeviceState::Enabling);
        enabling.map(|device| device.state = DeviceState::Enabled).is_some()
    }

    /// Notes that the verb that keeps a device going has ended; returns true if that end was commanded.
    pub fn servo_ended(&mut self, device: &str) -> bool {
        let Some(record) = self.logical.get_mut(device) else { return true };
        let asked = record.state == DeviceState::Stopping;
        record.state = if asked { DeviceState::Disabled } else { DeviceState::Fault };
        asked
    }
}

/// A logical device, as it runs.
pub(crate) struct LogicalRecord {
    /// Instance of its own verb, if its type has one.
    pub instance: Option<u64>,
    pub state: DeviceState,
    /// (SVV that is set, SVV it is set from) when it is enabled.
    pub copies: Vec<(String, String)>,
    /// Most time that may be lost at once while it moves, s: its parameter `max_gap`.
    pub gap_max_s: Option<f64>,
}

/// State of a logical device's own verb; whether it moves is seen from the verbs that use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeviceState {
    Disabled,
    Enabling,
    Enabled,
    Stopping,
    Fault,
}

/// A physical device and the source that serves it.
pub(crate) struct PhysicalRecord {
    pub device: Arc<Device>,
    pub source: SourceId,
    pub lost: Option<String>,
    /// Kind and options with which a remote one was opened.
    pub opened: Option<(String, String)>,
    /// Kind and options of its driver.
    pub driver: (String, serde_json::Value),
    /// Services and counters of a driver of this process.
    pub beside: Beside,
    /// Description by its driver.
    pub about: serde_json::Value,
    /// Text that the log has still to say at the next enabling: that nothing brings it to its safe state when its process is gone.
    pub unguarded_news: Option<String>,
}
