// SPDX-License-Identifier: Apache-2.0
//! Forced signals: an input whose value replaces the reading, or an output whose value replaces the command, in the exchange of its
//! device.
//!
//! A signal is a logical device with an argument `channel`. It is forced only while it is enabled, and each force ends with the session
//! that set it, with the device, and with an emergency stop. An alarm is active as long as the force lasts.
use crate::alarms::causes::{FORCED, alarm_forced, alarm_returns};
use crate::core::Core;
use crate::devices::forces::Force;
use crate::instances::following_errors::number;
use crate::pausing::modes::Mode;
use crate::refuse::{invalid_state, refuse, unknown};
use crate::registry::DeviceState;
use device::{Channel, Direction};
use indexmap::IndexMap;
use kernel::{FORCED_LEN_MAX, forced_word};
use model::configuration::{Configuration, LogicalDevice};
use model::definition::Argument;
use model::refusal::{Class, Refusals};
use model::value::Value;

/// Name of the argument of a signal's verb that is bound to the channel.
const CHANNEL: &str = "channel";

/// A request to force a signal, with its channel.
pub(crate) struct ForceRequest<'a> {
    pub name: &'a str,
    pub device: &'a str,
    pub channel: &'a str,
    pub value: &'a Value,
    /// Limits of an analog output.
    pub limits: Option<(f64, f64)>,
    pub who: &'a str,
}

impl<'a> ForceRequest<'a> {
    /// Creates the request for a logical device. Fails if the device has no channel of its own.
    pub fn of(configuration: &'a Configuration, name: &'a str, value: &'a Value, who: &'a str) -> Result<ForceRequest<'a>, Refusals> {
        let devices = &configuration.logical_devices;
        let Some(record) = devices.get(name) else { return Err(unknown("logical device", name, devices.keys().map(String::as_str))) };
        let Some(Argument::Channel { device, channel }) = record.arguments.get(CHANNEL) else {
            let remedy = "force a digital or analog input or output";
            return Err(refuse(
                Class::CallError,
                format!("'{name}' cannot be forced: it is a {}, which has no channel of its own", record.device_type),
                remedy,
            ));
        };
        Ok(ForceRequest { name, device, channel, value, limits: limits(record), who })
    }
}

/// Returns the parameters `low` and `high` of a device that has both.
fn limits(of: &LogicalDevice) -> Option<(f64, f64)> {
    let number = |name: &str| of.parameters.get(name).and_then(number);
    Some((number("low")?, number("high")?))
}

impl Core {
    /// Forces a signal, or changes the value that it is forced to. Returns the number of the force.
    pub fn force(&mut self, asked: &ForceRequest<'_>) -> Result<u64, Refusals> {
        let name = asked.name;
        self.safety.emergency.refuse("force", name)?;
        if self.registry.logical(name)?.state != DeviceState::Enabled {
            return Err(refuse(Class::NotEnabled, format!("cannot force '{name}': it is not enabled"), format!("enable '{name}' first")));
        }
        let Some(physical) = self.registry.physical.get(asked.device) else {
            return Err(unknown("physical device", asked.device, self.registry.physical.keys().map(String::as_str)));
        };
        let channels = physical.device.channels();
        let Some(index) = channels.iter().position(|channel| channel.name == asked.channel) else {
            return Err(unknown("channel", asked.channel, channels.iter().map(|channel| channel.name.as_str())));
        };
        let channel = &channels[index];
        let is_output = channel.direction == Direction::Write;
        self.check_force(asked, index, is_output)?;
        let (word, value) = encoded(asked, channel)?;
        physical.device.force(index, Some(word));
        let now_ns = self.host.now_ns();
        self.safety.forces.last += 1;
        let number = self.safety.forces.last;
        let force = Force { number, device: asked.device.to_owned(), channel: index, is_output, value, who: asked.who.to_owned(), since_ns: now_ns };
        let said = format!("to {}, by {}", force.value.described(), force.who);
        self.observation.log.add(now_ns, "force", name, said.clone());
        self.safety.forces.by_signal.insert(name.to_owned(), force);
        alarm_forced(self, name, is_output, &said);
        Ok(number)
    }

    /// Refuses channels that stop the machine or permit its motion, and outputs that the mode or an ending list protects.
    fn check_force(&self, asked: &ForceRequest<'_>, index: usize, is_output: bool) -> Result<(), Refusals> {
        let (name, device) = (asked.name, asked.device);
        let (safety, channel) = (&self.safety, format!("'{device}.{}'", asked.channel));
        if safety.emergency.inputs.iter().any(|input| input.device == device && input.channel == index) {
            let message = format!("cannot force '{name}': its channel {channel} is an emergency stop input");
            return Err(refuse(Class::NotAllowed, message, "operate the switch itself"));
        }
        if safety.modes.enabling.as_ref().is_some_and(|(of, at)| of == device && *at == index) {
            let message = format!("cannot force '{name}': its channel {channel} is the enabling switch");
            return Err(refuse(Class::NotAllowed, message, "operate the switch itself"));
        }
        if !is_output {
            return Ok(());
        }
        if safety.modes.mode == Mode::Manual
            && let Some((false, switch)) = safety.modes.enabling_switch(&self.registry)
        {
            let message = format!("cannot force '{name}' in manual mode: enabling switch '{switch}' is not held");
            return Err(refuse(Class::InvalidState, message, "hold it while the output is forced"));
        }
        let own = self.registry.logical[name].instance.and_then(|own| self.instances.get(&own));
        if own.is_some_and(|own| own.plan.ending.list.is_some()) {
            return Err(invalid_state(&format!("'{name}'"), "a device with an ending list, which a force would override", "force", "set the output instead"));
        }
        Ok(())
    }

    /// Refuses a forced channel as an emergency stop input or enabling switch.
    pub fn refuse_forced_switch(&self, device: &str, channel: usize) -> Result<(), Refusals> {
        let forced = self.safety.forces.by_signal.iter().find(|(_, force)| force.device == device && force.channel == channel);
        let Some((name, _)) = forced else { return Ok(()) };
        let message = format!("channel '{device}.{}' is forced by '{name}'", self.registry.physical[device].device.channels()[channel].name);
        Err(refuse(Class::InUse, message, format!("release '{name}' first")))
    }

    /// Ends the force of a signal. Returns false if it is not forced.
    pub fn release_force(&mut self, name: &str, why: &str) -> bool {
        let Some(force) = self.safety.forces.by_signal.shift_remove(name) else { return false };
        if let Some(physical) = self.registry.physical.get(&force.device) {
            physical.device.force(force.channel, None);
        }
        let now_ns = self.host.now_ns();
        self.observation.log.add(now_ns, "release", name, why);
        alarm_returns(self, FORCED, name);
        true
    }

    /// Ends the forces that `of` selects. Returns the signals that were released.
    pub fn release_forces(&mut self, why: &str, of: impl Fn(&str, &Force) -> bool) -> Vec<String> {
        let names: Vec<String> = self.safety.forces.by_signal.iter().filter(|(name, force)| of(name, force)).map(|(name, _)| name.clone()).collect();
        for name in &names {
            self.release_force(name, why);
        }
        names
    }

    /// Ends the forces of devices that are no longer enabled.
    pub fn release_idle_forces(&mut self) {
        let is_idle = |name: &&String| self.registry.logical.get(*name).is_none_or(|record| record.state != DeviceState::Enabled);
        let idle: Vec<String> = self.safety.forces.by_signal.keys().filter(is_idle).cloned().collect();
        for name in &idle {
            self.release_force(name, "the device is no longer enabled");
        }
    }

    /// Ends the force of an output if its limits have changed so that they no longer allow the forced value.
    pub fn release_force_beyond(&mut self, name: &str, configuration: &Configuration) {
        let limits = configuration.logical_devices.get(name).and_then(limits);
        let value = self.safety.forces.by_signal.get(name).filter(|force| force.is_output).and_then(|force| number(&force.value));
        if let (Some((low, high)), Some(value)) = (limits, value)
            && !(low..=high).contains(&value)
        {
            self.release_force(name, "the limits of the output have changed");
        }
    }
}

/// Returns a forced value as a word of the channel, and as a number or a bool in the unit of the channel.
fn encoded(asked: &ForceRequest<'_>, channel: &Channel) -> Result<(u64, Value), Refusals> {
    let name = asked.name;
    let within = |message: String, remedy: String| refuse(Class::OutOfRange, message, remedy);
    let of = model::types::Type::parse(&channel.type_text, &IndexMap::new()).map_err(|refusal| vec![refusal])?;
    if of.size() > FORCED_LEN_MAX || channel.type_text.contains('[') {
        let message = format!("cannot force '{name}': its channel has the type {}", channel.type_text);
        return Err(refuse(Class::CallError, message, "force a signal with a single number or bool"));
    }
    let bytes = of.encode(asked.value, &channel.unit).map_err(|refusal| vec![crate::starting::psi::named(refusal, name)])?;
    let value = of.decode(&bytes);
    if let Some(number) = number(&value) {
        if !number.is_finite() {
            return Err(within(format!("'{name}' cannot be forced to {number}"), "give a finite number".to_owned()));
        }
        if let Some((low, high)) = asked.limits.filter(|(low, high)| !(*low..=*high).contains(&number)) {
            let unit = if channel.unit.is_empty() { String::new() } else { format!(" {}", channel.unit) };
            let message = format!("'{name}' cannot be forced to {number}{unit}: the range of the output is {low} to {high}{unit}");
            return Err(within(message, "give a value within the range".to_owned()));
        }
    }
    Ok((forced_word(&bytes), value))
}
