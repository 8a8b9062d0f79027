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

/// Registry of the running configuration.
#[derive(Default)]
pub(crate) struct Registry {
    /// `rtp.name` → source.
    pub sources: IndexMap<String, SourceId>,
    /// Specification of each source, by number.
    pub specs: Vec<SourceSpec>,
    pub svvs: IndexMap<String, SvvRecord>,
    /// Number of SVVs created so far. Each SVV keeps its number for the lifetime of the system.
    pub svvs_made: u32,
    pub physical: IndexMap<String, PhysicalRecord>,
    pub logical: IndexMap<String, LogicalRecord>,
    /// Instance that holds each claim and may therefore write.
    pub claims: HashMap<Claim, u64>,
}

impl Registry {
    /// Returns the name of a source, as `rtp.name`.
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

    /// Marks a device that was being enabled as ready; returns false if it was not being enabled.
    pub fn note_ready(&mut self, device: &str) -> bool {
        let enabling = self.logical.get_mut(device).filter(|device| device.state == DeviceState::Enabling);
        enabling.map(|device| device.state = DeviceState::Enabled).is_some()
    }

    /// Records that a device's own verb has ended; returns true if the end was commanded.
    pub fn servo_ended(&mut self, device: &str) -> bool {
        let Some(record) = self.logical.get_mut(device) else { return true };
        let asked = record.state == DeviceState::Stopping;
        record.state = if asked { DeviceState::Disabled } else { DeviceState::Fault };
        asked
    }
}

/// A logical device at run time.
pub(crate) struct LogicalRecord {
    /// Instance of the device's own verb, if its type has a verb.
    pub instance: Option<u64>,
    pub state: DeviceState,
    /// Pairs of SVVs for enabling: (SVV that is set, SVV from which it is copied).
    pub copies: Vec<(String, String)>,
    /// Maximum single loss of time during motion, s: parameter `max_gap` of the device.
    pub gap_max_s: Option<f64>,
}

/// State of a logical device's own verb. Whether the device is moving is determined from the verbs that use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeviceState {
    Disabled,
    Enabling,
    Enabled,
    Stopping,
    Fault,
}

/// A physical device and its source.
pub(crate) struct PhysicalRecord {
    pub device: Arc<Device>,
    pub source: SourceId,
    pub lost: Option<String>,
    /// Time at which the device was last lost, ns; its readings are older.
    pub lost_ns: i64,
    /// Kind and options with which a remote device was opened.
    pub opened: Option<(String, String)>,
    /// Kind and options of the driver.
    pub driver: (String, serde_json::Value),
    /// Services and counters of a driver in this process.
    pub beside: Beside,
    /// Driver's description of the device.
    pub about: serde_json::Value,
    /// Text to be logged the next time the device is enabled, stating that it is not made safe if its process exits.
    pub unguarded_news: Option<String>,
}
