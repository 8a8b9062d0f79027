// SPDX-License-Identifier: Apache-2.0
//! What there is in a system, in full: for a programming system that comes later and takes up what another one configured.
use crate::system::System;
use serde_json::{Map, Value as Json, json};

impl System {
    /// Processors, sources, physical devices as their drivers described them, logical devices and their types.
    ///
    /// `{processors: {name: {core, supervisor}}, sources: {name: {processor, kind, priority}}, physical_devices: {name: {source,
    /// channels, …}}, logical_devices: {name: type}, device_types: {name: definition}}`. `kind`: `"trigger"`, `"software"` or
    /// `{"timer": {"period_ns"}}`.
    pub fn configuration_json(&self) -> Json {
        let definitions = self.shared.definitions();
        let core = self.shared.locked();
        let processors: Map<String, Json> =
            definitions.processors.iter().map(|(name, p)| (name.clone(), json!({ "core": p.core, "supervisor": p.supervisor }))).collect();
        let physical: Map<String, Json> = (definitions.configuration.devices.iter())
            .map(|(name, device)| {
                let mut described = core.physical.get(name).map_or_else(|| json!({}), |record| record.about.clone());
                described["source"] = json!(device.source);
                described["channels"] = json!(device.channels);
                (name.clone(), described)
            })
            .collect();
        let logical: Map<String, Json> =
            definitions.configuration.logical_devices.iter().map(|(name, device)| (name.clone(), json!(device.device_type))).collect();
        json!({
            "processors": processors, "sources": definitions.configuration.sources, "physical_devices": physical,
            "logical_devices": logical, "device_types": definitions.configuration.device_types,
        })
    }
}
