// SPDX-License-Identifier: Apache-2.0
//! Full inventory of a system, for a programming system that connects later and adopts a configuration created by another one.
use crate::refuse::{refuse, unknown};
use crate::system::System;
use device::{CounterAbout, Geometry, JointKind, SafeStateAbout, ServiceAbout};
use indexmap::IndexMap;
use model::configuration::{Channel, Source};
use model::definition::DeviceType;
use model::refusal::{Class, Refusals};
use model::value::Value;
use serde::{Deserialize, Serialize};

/// Configuration: processors, interrupt sources, physical devices, logical devices and their types.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Configuration"))]
pub struct Inventory {
    pub processors: IndexMap<String, ProcessorAbout>,
    /// Interrupt sources, `rtp.source`.
    pub sources: IndexMap<String, Source>,
    /// Physical devices as described by their drivers.
    pub physical_devices: IndexMap<String, PhysicalDeviceAbout>,
    /// Logical devices with their device types.
    pub logical_devices: IndexMap<String, String>,
    pub device_types: IndexMap<String, DeviceType>,
}

/// A real-time processor.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ProcessorAbout {
    /// CPU core to which the processor is bound.
    pub core: Option<usize>,
    /// True if the supervisor runs on the processor.
    pub supervisor: bool,
    /// Process in which the processor runs; null for that of the supervisor.
    pub process: Option<String>,
    /// Host on which the processor runs; null for that of the supervisor.
    pub host: Option<String>,
}

/// A physical device as described by its driver.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PhysicalDevice"))]
pub struct PhysicalDeviceAbout {
    /// Interrupt source that reads and writes the device; absent from the answer to the call that opens it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    #[serde(default)]
    pub channels: Vec<Channel>,
    /// Joints of the machine, for which logical devices can be created.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parts: Option<Vec<DevicePart>>,
    /// Time without a command after which the device enters its safe state, ns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub watchdog_ns: Option<u64>,
    /// True if the device continues to follow its last commands when its driver's process exits or hangs, because it has no watchdog and
    /// no guard can reach it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unguarded: bool,
    /// Explanation of `unguarded` and the remedy; absent if the device can be made safe.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unguarded_why: Option<String>,
    /// Execution context of the driver's exchange: "inline", "worker" or "process".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<String>,
    /// Agents that bring the outputs to their safe state, and the time that they take to do so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub safe_state: Option<SafeStateAbout>,
    /// Acyclic services of the driver.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub services: Vec<ServiceAbout>,
    /// Counters of the driver.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counters: Vec<CounterAbout>,
    /// Additional properties declared by the driver.
    #[serde(flatten)]
    pub more: IndexMap<String, Option<Value>>,
}

/// A joint of a machine.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DevicePart {
    pub name: String,
    /// Additional properties declared by the driver: for a joint `unit`, `range_min`, `range_max`, `effort_max`, `speed_max`, `home`, and
    /// `servo` with the gains `kp` and `kd`. 1e6 means no limit.
    #[serde(flatten)]
    pub more: IndexMap<String, Option<Value>>,
}

impl PhysicalDeviceAbout {
    /// Parses a driver's description of itself.
    pub(crate) fn of_driver(description: &serde_json::Value, channels: Vec<Channel>) -> Result<PhysicalDeviceAbout, String> {
        let described: PhysicalDeviceAbout = serde_json::from_value(description.clone()).map_err(|why| why.to_string())?;
        Ok(PhysicalDeviceAbout { channels, ..described })
    }
}

impl System {
    /// Returns the processors, sources, physical devices as described by their drivers, logical devices and their types.
    pub fn inventory(&self) -> Inventory {
        let definitions = self.shared.definitions();
        let core = self.shared.locked();
        let configuration = &definitions.configuration;
        let processors = definitions.processors.iter().map(|(name, p)| {
            let (process, host) = (p.location.process(name).map(str::to_owned), p.location.host().map(str::to_owned));
            (name.clone(), ProcessorAbout { core: p.core, supervisor: p.supervisor, process, host })
        });
        let physical = configuration.devices.iter().map(|(name, device)| {
            let of_driver = |record: &crate::registry::PhysicalRecord| PhysicalDeviceAbout::of_driver(&record.about, device.channels.clone()).ok();
            let about = core.registry.physical.get(name).and_then(of_driver).unwrap_or_default();
            (name.clone(), PhysicalDeviceAbout { source: Some(device.source.clone()), channels: device.channels.clone(), ..about })
        });
        Inventory {
            processors: processors.collect(),
            sources: configuration.sources.clone(),
            physical_devices: physical.collect(),
            logical_devices: configuration.logical_devices.iter().map(|(name, device)| (name.clone(), device.device_type.clone())).collect(),
            device_types: configuration.device_types.clone(),
        }
    }

    /// Returns the bodies of a physical device for drawing. Joints and contacts include `svv`, the name under which they can be read, if
    /// the device has a channel for them. Fails if the device does not exist or has no geometry.
    pub fn geometry(&self, device: &str) -> Result<Geometry, Refusals> {
        let (driver, channels) = {
            let core = self.shared.locked();
            let record =
                core.registry.physical.get(device).ok_or_else(|| unknown("physical device", device, core.registry.physical.keys().map(String::as_str)))?;
            let channels: Vec<String> = record.device.channels().iter().map(|channel| channel.name.clone()).collect();
            (record.driver.clone(), channels)
        };
        let found =
            drivers::geometry(&driver.0, &driver.1).map_err(|why| refuse(Class::DeviceFailed, format!("device '{device}' cannot be drawn: {why}"), ""))?;
        let none = || {
            refuse(
                Class::InvalidState,
                format!("device '{device}' has no geometry: its driver '{}' provides none", driver.0),
                "name a device that is simulated from a model",
            )
        };
        let mut geometry = found.ok_or_else(none)?;
        for joint in geometry.bodies.iter_mut().flat_map(|body| body.joint.iter_mut().chain(&mut body.joints)) {
            let told = if joint.kind == JointKind::Free { "pose" } else { "position" };
            let channel = format!("{}.{told}", joint.name);
            joint.svv = channels.contains(&channel).then(|| format!("{device}.{channel}"));
        }
        geometry.contacts = channels.iter().any(|channel| channel == "contacts").then(|| format!("{device}.contacts"));
        Ok(geometry)
    }
}
