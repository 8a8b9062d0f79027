// SPDX-License-Identifier: Apache-2.0
//! Physical devices, which are opened and closed in the process in which their source runs.
use crate::alarms::causes::alarm_closed;
use crate::definitions::system_definitions::Definitions;
use crate::observation::inventory::PhysicalDeviceAbout;
use crate::refuse::{invalid_state, known_unit, refuse, refuse_at, unknown};
use crate::registry::PhysicalRecord;
use crate::stopping::unguarded;
use crate::system::System;
use device::Direction;
use model::configuration::{Channel, PhysicalDevice, SourceKind};
use model::plan::CellKind;
use model::refusal::{Class, Refusals, SourceLocation};
use std::sync::Arc;

impl System {
    /// Opens a physical device. Returns its channels and the driver's description of the device.
    pub fn physical_device(
        &self,
        processor: &str,
        name: &str,
        kind: &str,
        options: &serde_json::Value,
        source: &str,
        place: Option<SourceLocation>,
    ) -> Result<PhysicalDeviceAbout, Refusals> {
        let mut definitions = self.shared.definitions();
        crate::definitions::sane::check_name("the name of a physical device", name)?;
        let configuration = &definitions.configuration;
        if configuration.devices.contains_key(name) {
            return Err(refuse_at(Class::InUse, format!("there is already a physical device '{name}'"), "give it another name", place));
        }
        match configuration.sources.get(source) {
            None => return Err(unknown("source", source, configuration.sources.keys().map(String::as_str))),
            Some(s) if s.processor != processor => {
                return Err(refuse_at(
                    Class::PlacementError,
                    format!("device '{name}' of processor '{processor}' cannot be exchanged by source '{source}'"),
                    format!("name a source of '{processor}'"),
                    place,
                ));
            }
            Some(_) => {}
        }
        // Under the virtual clock nothing may run at its own pace.
        let (kind, options) = if self.shared.is_virtual { drivers::in_virtual_time(kind, options) } else { (kind.to_owned(), options.clone()) };
        let (device, beside, mut description, opened) = (self.open_device(processor, name, &kind, &options))
            .map_err(|why| refuse_at(Class::DeviceFailed, format!("cannot open device '{name}': {}", model::wording::plain_within(&why)), "", place.clone()))?;
        if let Err(refused) = self.refuse_slow(&definitions, name, source, &description) {
            self.shut(processor, name);
            return Err(refused);
        }
        let host = definitions.processors.get(processor).and_then(|of| of.location.host());
        unguarded::describe(name, host, &mut description);
        let channels: Vec<Channel> = (device.channels().iter())
            .map(|c| Channel { name: c.name.clone(), write: c.direction == Direction::Write, type_text: c.type_text.clone(), unit: c.unit.clone() })
            .collect();
        for channel in &channels {
            known_unit(&channel.unit, &format!("channel '{name}.{}'", channel.name), &place)?;
        }
        let about = match PhysicalDeviceAbout::of_driver(&description, channels.clone()) {
            Ok(about) => about,
            Err(why) => {
                self.shut(processor, name);
                let message = format!("cannot open device '{name}': the description of its driver is invalid: {why}");
                return Err(refuse_at(Class::DeviceFailed, message, "", place));
            }
        };
        self.shared.command(|core| {
            let id = core.registry.sources[source];
            let unguarded_news = about.unguarded_why.clone().filter(|_| !self.shared.is_virtual);
            device.obey(core.safety.emergency.stop.clone());
            core.wiring.tables.get_mut(&id).expect("a source has its table as long as the system lives").devices.push(device.clone());
            let record =
                PhysicalRecord { device, source: id, lost: None, lost_ns: 0, opened, driver: (kind, options), beside, about: description, unguarded_news };
            core.registry.physical.insert(name.to_owned(), record);
            let op = core.carrier().table_op(id);
            core.submit(id, vec![op], crate::scripts::Purpose::Nothing);
            Ok(())
        })?;
        definitions
            .configuration
            .devices
            .insert(name.to_owned(), PhysicalDevice { processor: processor.to_owned(), source: source.to_owned(), channels, place });
        Ok(about)
    }

    /// Refuses a source that is too slow for a device with its own watchdog, because the device must be commanded in time even if one
    /// firing is late.
    fn refuse_slow(&self, definitions: &Definitions, name: &str, source: &str, about: &serde_json::Value) -> Result<(), Refusals> {
        let Some(timeout_ns) = about["watchdog_ns"].as_u64() else { return Ok(()) };
        let ms = |ns: u64| ns as f64 * 1e-6;
        let why = match definitions.configuration.sources[source].kind {
            SourceKind::Timer { period_ns } if 2 * period_ns <= timeout_ns => return Ok(()),
            SourceKind::Timer { period_ns } => {
                format!("source '{source}' commands it every {} ms, so one late firing would put it into that state", ms(period_ns))
            }
            _ => format!("source '{source}' is not a timer, so the times of its commands are not known"),
        };
        let message = format!("device '{name}' goes to its safe state after {} ms without a command, but {why}", ms(timeout_ns));
        Err(refuse(Class::PlacementError, message, "exchange it with a timer whose period is at most half its timeout, or give it a longer timeout="))
    }

    /// Closes a physical device to which no instance is bound.
    pub fn delete_physical_device(&self, name: &str) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        self.shared.command(|core| {
            let Some(physical) = core.registry.physical.get(name) else {
                return Err(unknown("physical device", name, core.registry.physical.keys().map(String::as_str)));
            };
            let bound =
                |i: &&crate::instances::instance::Instance| i.plan.cells.iter().any(|c| matches!(&c.kind, CellKind::Channel { device, .. } if device == name));
            if let Some(user) = core.instances.values().find(bound) {
                return Err(invalid_state(
                    &format!("physical device '{name}'"),
                    &format!("bound by '{}'", user.name),
                    "delete",
                    "delete that instance or device first",
                ));
            }
            if core.safety.emergency.inputs.iter().any(|input| input.device == name)
                || core.safety.modes.enabling.as_ref().is_some_and(|(device, _)| device == name)
            {
                let what = "needed: one of its channels is an emergency stop input or the enabling switch";
                return Err(invalid_state(&format!("physical device '{name}'"), what, "delete", "keep it until the system is closed"));
            }
            let (source, device) = (physical.source, physical.device.clone());
            core.registry.physical.shift_remove(name);
            alarm_closed(core, name);
            let table = core.wiring.tables.get_mut(&source).expect("a source has its table as long as the system lives");
            table.devices.retain(|d| !Arc::ptr_eq(d, &device));
            table.edges.retain(|(of, _)| of != name);
            let op = core.carrier().table_op(source);
            core.submit(source, vec![op], crate::scripts::Purpose::Nothing);
            if let Some(remote) = core.remote.at(core.registry.source_name(source)) {
                remote.shut(name);
            }
            Ok(())
        })?;
        self.shared.guarded.release(name);
        definitions.configuration.devices.shift_remove(name);
        Ok(())
    }
}
