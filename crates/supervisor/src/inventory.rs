// SPDX-License-Identifier: Apache-2.0
//! What there is in a system, in full: for a programming system that comes later and takes up what another one configured.
use crate::refuse::{refuse, unknown};
use crate::system::System;
use model::refusal::{Class, Refusals};
use serde_json::{Map, Value as Json, json};

impl System {
    /// Processors, sources, physical devices as their drivers described them, logical devices and their types.
    ///
    /// `{processors: {name: {core, supervisor, process, host}}, sources: {name: {processor, kind, priority}}, physical_devices: {name: {source,
    /// channels, …}}, logical_devices: {name: type}, device_types: {name: definition}}`. `process`, `host`: the name
    /// of each where the processor is not in the supervisor's process. `kind`: `"trigger"`, `"software"` or `{"timer": {"period_ns"}}`.
    pub fn configuration_json(&self) -> Json {
        let definitions = self.shared.definitions();
        let core = self.shared.locked();
        let processors: Map<String, Json> = (definitions.processors.iter())
            .map(|(name, p)| {
                let (process, host) = (p.location.process(name), p.location.host());
                (name.clone(), json!({ "core": p.core, "supervisor": p.supervisor, "process": process, "host": host }))
            })
            .collect();
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
    /// The bodies of a physical device for drawing, `{"bodies": […], "meshes": […]}`; each joint with the name by which its position
    /// is read, `svv`, where the device has a channel for it. Errors: no such device, one that has no shape.
    pub fn geometry_json(&self, device: &str) -> Result<Json, Refusals> {
        let (driver, channels) = {
            let core = self.shared.locked();
            let record = core.physical.get(device).ok_or_else(|| unknown("physical device", device, core.physical.keys().map(String::as_str)))?;
            let channels: Vec<String> = record.device.channels().iter().map(|channel| channel.name.clone()).collect();
            (record.driver.clone(), channels)
        };
        let found =
            drivers::geometry(&driver.0, &driver.1).map_err(|why| refuse(Class::DeviceFailed, format!("device '{device}' cannot be drawn: {why}"), ""))?;
        let none = || refuse(Class::InvalidState, format!("device '{device}' has no shape: its driver is '{}'", driver.0), "ask for one that MuJoCo simulates");
        let mut geometry = found.ok_or_else(none)?;
        let bodies = geometry["bodies"].as_array_mut().into_iter().flatten();
        let joints = bodies.flat_map(|body| body.as_object_mut().into_iter().flatten().filter(|(key, _)| *key == "joint" || *key == "joints"));
        for (_, of) in joints {
            match of {
                Json::Array(joints) => joints.iter_mut().for_each(|joint| name_position(joint, device, &channels)),
                Json::Object(_) => name_position(of, device, &channels),
                _ => {}
            }
        }
        Ok(geometry)
    }
}

/// Says by which name the position of a joint is read.
fn name_position(joint: &mut Json, device: &str, channels: &[String]) {
    let position = joint["name"].as_str().map(|name| format!("{name}.position")).filter(|name| channels.contains(name));
    joint["svv"] = json!(position.map(|position| format!("{device}.{position}")));
}
