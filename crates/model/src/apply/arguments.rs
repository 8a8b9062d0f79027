// SPDX-License-Identifier: Apache-2.0
//! Arguments: bindings of the instantiation parameters. Members of a device are matched to parameters by name.
use super::{Draft, GroupBinding};
use crate::configuration::Svv;
use crate::definition::Argument;
use crate::parameters::Whose;
use crate::refusal::Class;
use hints::did_you_mean;

impl<'a> Draft<'a> {
    /// Returns the binding of each group.
    pub fn arguments(&mut self) -> Vec<GroupBinding<'a>> {
        self.resolve_objects();
        self.refuse_unknown_arguments();
        let mut given: Vec<GroupBinding<'a>> = Vec::new();
        given.resize_with(self.checked.groups.len(), || GroupBinding::Private);
        if !self.refusals.is_empty() {
            return given;
        }
        let checked = self.checked;
        for (group, whose) in &checked.parameters {
            let name = checked.groups[*group].name.as_str();
            let found = match whose {
                Whose::Object { object, member } => self.members(object, member),
                Whose::Own => self.own(name),
                Whose::Part { argument, channel } => self.part(name, argument, channel),
            };
            if let Some(found) = found {
                given[*group] = found;
            }
        }
        given
    }

    fn resolve_objects(&mut self) {
        let (checked, application) = (self.checked, self.application);
        for (name, object) in &checked.objects {
            let devices: Vec<&'a str> = match application.arguments.get(name) {
                Some(Argument::Device(device)) => vec![device.as_str()],
                Some(Argument::Devices(devices)) if object.each || devices.len() == 1 => devices.iter().map(String::as_str).collect(),
                Some(Argument::Devices(devices)) => {
                    let message = format!("'{name}' of verb '{}' takes one {}, not {}", checked.name, object.device_type, devices.len());
                    self.refuse(Class::CallError, message, "declare it with each() to take several", &None);
                    Vec::new()
                }
                Some(_) => {
                    self.refuse(
                        Class::CallError,
                        format!("'{name}' of verb '{}' takes a {}", checked.name, object.device_type),
                        "pass a logical device",
                        &None,
                    );
                    Vec::new()
                }
                None => {
                    self.refuse(
                        Class::CallError,
                        format!("verb '{}' requires the argument '{name}', a {}", checked.name, object.device_type),
                        "pass a logical device",
                        &None,
                    );
                    Vec::new()
                }
            };
            for (at, device) in devices.iter().enumerate() {
                self.check_device(name, device, &object.device_type);
                if devices[..at].contains(device) {
                    self.refuse(
                        Class::CallError,
                        format!("'{name}' of verb '{}' is given the device '{device}' twice", checked.name),
                        "give each device once",
                        &None,
                    );
                }
            }
            self.objects.push(devices);
        }
    }

    fn check_device(&mut self, object: &str, device: &str, device_type: &str) {
        match self.configuration.logical_devices.get(device) {
            None => {
                let remedy = did_you_mean(device, self.configuration.logical_devices.keys().map(String::as_str));
                self.refuse(Class::UnknownName, format!("there is no logical device '{device}'"), &remedy, &None);
            }
            Some(found) if found.device_type != device_type => {
                let message = format!("'{object}' of verb '{}' takes a {device_type}, but '{device}' is a {}", self.checked.name, found.device_type);
                self.refuse(Class::CallError, message, &format!("give a {device_type}"), &None);
            }
            Some(_) => {}
        }
    }

    fn refuse_unknown_arguments(&mut self) {
        let checked = self.checked;
        let mut names: Vec<&str> = checked.objects.keys().map(String::as_str).collect();
        for (group, whose) in &checked.parameters {
            match whose {
                Whose::Own => names.push(&checked.groups[*group].name),
                Whose::Part { argument, .. } => names.extend([argument.as_str(), &checked.groups[*group].name]),
                Whose::Object { .. } => {}
            }
        }
        for name in self.application.arguments.keys() {
            if !names.contains(&name.as_str()) {
                let is_input = checked.inputs.iter().any(|input| input.name == *name);
                let remedy = if is_input { format!("'{name}' is an input parameter; give it at the start") } else { did_you_mean(name, names.iter().copied()) };
                self.refuse(Class::CallError, format!("verb '{}' has no instantiation parameter '{name}'", checked.name), &remedy, &None);
            }
        }
    }

    fn members(&mut self, object: &str, member: &str) -> Option<GroupBinding<'a>> {
        let configuration = self.configuration;
        let at = self.checked.objects.get_index_of(object)?;
        let mut svvs = Vec::with_capacity(self.objects[at].len());
        for device in self.objects[at].clone() {
            match configuration.logical_devices.get(device).and_then(|found| found.svvs.get(member)) {
                Some(name) => svvs.extend(self.svv(name)),
                None => self.refuse(Class::UnknownName, format!("the device '{device}' has no SVV '{member}'"), "declare it in the device type", &None),
            }
        }
        Some(GroupBinding::Svvs(svvs))
    }

    fn own(&mut self, name: &'a str) -> Option<GroupBinding<'a>> {
        let (application, configuration) = (self.application, self.configuration);
        let owner = application.owner.as_ref().and_then(|owner| configuration.logical_devices.get(owner));
        let argument = application.arguments.get(name).or_else(|| owner?.arguments.get(name));
        match argument {
            Some(argument) => self.argument(name, argument),
            None => match owner.and_then(|owner| owner.svvs.get(name)) {
                Some(svv) => Some(GroupBinding::Svvs(self.svv(svv).into_iter().collect())),
                None => {
                    let message = format!("verb '{}' needs the instantiation parameter '{name}'", self.checked.name);
                    self.refuse(Class::CallError, message, "give an SVV or a channel, or make it a cell of the verb", &None);
                    None
                }
            },
        }
    }

    fn argument(&mut self, name: &str, argument: &'a Argument) -> Option<GroupBinding<'a>> {
        match argument {
            Argument::Svv(svv) => Some(GroupBinding::Svvs(self.svv(svv).into_iter().collect())),
            Argument::Svvs(svvs) => Some(GroupBinding::Svvs(svvs.iter().filter_map(|svv| self.svv(svv)).collect())),
            Argument::Channel { device, channel } => self.channel(device, channel),
            Argument::Part { .. } | Argument::Device(_) | Argument::Devices(_) => {
                let message = format!("'{name}' of verb '{}' takes an SVV or a channel", self.checked.name);
                self.refuse(Class::CallError, message, "give an SVV or a channel", &None);
                None
            }
        }
    }

    fn part(&mut self, name: &'a str, argument: &'a str, channel: &str) -> Option<GroupBinding<'a>> {
        let (application, configuration) = (self.application, self.configuration);
        let owner = application.owner.as_ref().and_then(|owner| configuration.logical_devices.get(owner));
        let of = |name: &str| application.arguments.get(name).or_else(|| owner?.arguments.get(name));
        if let Some(whole) = of(name) {
            return self.argument(name, whole);
        }
        match of(argument) {
            Some(Argument::Part { device, part }) => self.channel(device, &format!("{part}.{channel}")),
            Some(_) => {
                let message = format!("'{argument}' of verb '{}' takes a part of a physical device", self.checked.name);
                self.refuse(Class::CallError, message, "give, for example, arm['elbow']", &None);
                None
            }
            None => {
                let message = format!("verb '{}' needs '{argument}', a part of a physical device with a channel '{channel}'", self.checked.name);
                self.refuse(Class::CallError, message, "give, for example, arm['elbow']", &None);
                None
            }
        }
    }

    fn svv(&mut self, name: &'a str) -> Option<(&'a str, &'a Svv)> {
        let found = self.configuration.svvs.get_key_value(name);
        if found.is_none() {
            let remedy = did_you_mean(name, self.configuration.svvs.keys().map(String::as_str));
            self.refuse(Class::UnknownName, format!("there is no SVV '{name}'"), &remedy, &None);
        }
        found.map(|(name, svv)| (name.as_str(), svv))
    }

    fn channel(&mut self, device: &str, channel: &str) -> Option<GroupBinding<'a>> {
        let Some((name, physical)) = self.configuration.devices.get_key_value(device) else {
            let remedy = did_you_mean(device, self.configuration.devices.keys().map(String::as_str));
            self.refuse(Class::UnknownName, format!("there is no physical device '{device}'"), &remedy, &None);
            return None;
        };
        let found = physical.channels.iter().position(|c| c.name == channel);
        let Some(channel) = found else {
            let remedy = did_you_mean(channel, physical.channels.iter().map(|c| c.name.as_str()));
            self.refuse(Class::UnknownName, format!("the physical device '{device}' has no channel '{channel}'"), &remedy, &None);
            return None;
        };
        Some(GroupBinding::Channel { device: name, channel, physical })
    }
}
