// SPDX-License-Identifier: Apache-2.0
//! The emergency stop: it ends every action, brings devices to their safe state and latches. It is not a certified safety function.
//!
//! The flag that all devices of the host look at before each write is set by the kernel that reads a tripped input, in that very
//! firing: its outputs are safe from that firing's write on, those of other sources from their next. The supervisor follows: it
//! ends the verbs, and nothing starts until the reset.
use crate::core::{Core, DeviceState, Purpose};
use crate::refuse::{invalid_state, refuse, unknown};
use crate::system::System;
use kernel::{Ask, Direction, Op};
use model::refusal::{Class, Refusals};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The emergency stop as the supervisor keeps it.
#[derive(Default)]
pub(crate) struct Emergency {
    /// Why it is latched.
    pub reason: Option<String>,
    /// Channels that trip it.
    pub inputs: Vec<Input>,
    /// What every device of the host obeys.
    pub stop: Arc<AtomicBool>,
}

/// A read channel whose reading asks for something.
pub(crate) struct Input {
    pub device: String,
    pub channel: usize,
    /// It was told of since the last reset.
    told: bool,
}

impl Core {
    /// Refuses a call while the emergency stop is latched.
    pub fn refuse_emergency(&self, call: &str, what: &str) -> Result<(), Refusals> {
        let Some(reason) = &self.emergency.reason else { return Ok(()) };
        Err(refuse(Class::EmergencyStopped, format!("cannot {call} '{what}': the emergency stop is latched ({reason})"), "remove the cause and call reset()"))
    }

    /// Ends every action, brings the devices to their safe state, and latches. A further cause while it is latched is recorded.
    /// `source`: the input that tripped it, or `system`.
    pub fn emergency_stop(&mut self, source: &str, reason: &str) {
        let now_ns = self.host.now_ns();
        self.log.add(now_ns, "emergency_stop", source, reason);
        self.alarm_emergency(source, reason);
        self.emergency.stop.store(true, Ordering::Release);
        self.host.stop_abroad(true);
        if self.emergency.reason.is_some() {
            return;
        }
        self.emergency.reason = Some(reason.to_owned());
        self.pause.clear();
        self.safe_all();
        let (mut actions, servos): (Vec<u64>, Vec<u64>) = {
            let running = self.instances.values().filter(|i| i.is_busy());
            let (a, s): (Vec<_>, Vec<_>) = running.partition(|i| i.owner.is_none());
            (a.iter().map(|i| i.id).collect(), s.iter().map(|i| i.id).collect())
        };
        self.queued_first(&mut actions);
        for id in actions.into_iter().chain(servos) {
            if let Some(owner) = self.instances.get(&id).and_then(|i| i.owner.clone()) {
                self.set_device(&owner, DeviceState::Stopping);
            }
            self.end_now(id, "emergency_stop", reason);
        }
        // A device without a verb has nobody who would say that it has stopped.
        for record in self.logical.values_mut().filter(|r| r.instance.is_none() && r.state == DeviceState::Enabled) {
            record.state = DeviceState::Disabled;
        }
    }

    /// Every output goes to its safe value at once, whether or not its source fires soon.
    fn safe_all(&mut self) {
        for (device, source) in self.physical.values().map(|p| (p.device.clone(), p.source)).collect::<Vec<_>>() {
            let channels = (0..device.channels().len()).filter(|c| device.channels()[*c].direction == Direction::Write);
            let channels = channels.map(|c| u16::try_from(c).expect("a device has fewer than 65,536 channels")).collect();
            self.submit(source, vec![Op::Safe { device, channels }], Purpose::Nothing);
        }
    }

    /// Lifts the latch, restarts the sources that faults stopped. Refused while a cause is present, naming it.
    pub fn reset(&mut self) -> Result<(), Refusals> {
        let present: Vec<String> =
            self.emergency.inputs.iter().filter(|i| self.physical[&i.device].device.asks(i.channel)).map(|i| self.input_name(i)).collect();
        if !present.is_empty() {
            let present = present.join(", ");
            return Err(refuse(Class::EmergencyStopped, format!("cannot reset: the cause is still present ({present})"), "remove it first"));
        }
        if let Some(busy) = self.instances.values().find(|i| i.is_busy() && self.emergency.reason.is_some()) {
            return Err(invalid_state(&format!("'{}'", busy.name), "still ending", "reset while", "wait for it"));
        }
        self.emergency.reason = None;
        for input in &mut self.emergency.inputs {
            input.told = false;
            self.physical[&input.device].device.forget(input.channel);
        }
        self.emergency.stop.store(false, Ordering::Release);
        self.host.stop_abroad(false);
        self.alarm_reset();
        self.poisoned.clear();
        // What was lost with a source that only was silent is there again with it.
        for physical in self.physical.values_mut().filter(|physical| self.lost.contains(&physical.source) && !physical.device.is_lost()) {
            physical.lost = None;
        }
        self.lost.clear();
        let stopped: Vec<_> = self.sources.values().copied().filter(|s| self.host.statistics(*s).stopped).collect();
        for source in stopped {
            self.host.restart(source);
        }
        for record in self.logical.values_mut().filter(|r| r.state == DeviceState::Fault) {
            record.state = DeviceState::Disabled;
        }
        Ok(())
    }

    /// Follows what kernels have read: every input that has tripped since the last reset is a cause.
    pub fn watch_inputs(&mut self) {
        for index in 0..self.emergency.inputs.len() {
            let input = &self.emergency.inputs[index];
            if !input.told && self.physical[&input.device].device.asked(input.channel) {
                let (source, reason) = (self.channel_name(input), self.input_name(input));
                self.emergency.inputs[index].told = true;
                self.emergency_stop(&source, &reason);
            }
        }
        self.watch_enabling_switch();
    }

    /// `emergency stop input 'io.gate'`, and why where it is not its reading.
    fn input_name(&self, input: &Input) -> String {
        let name = format!("emergency stop input '{}'", self.channel_name(input));
        if self.physical[&input.device].device.is_lost() { format!("{name}: its device was lost") } else { name }
    }

    fn channel_name(&self, input: &Input) -> String {
        format!("{}.{}", input.device, self.physical[&input.device].device.channels()[input.channel].name)
    }
}

impl System {
    /// From its next reading on, a channel trips the emergency stop when it is not 0 (`at_zero`: when it is 0, as a normally closed
    /// contact does). Losing its device trips it too.
    pub fn emergency_stop_input(&self, device: &str, channel: &str, at_zero: bool) -> Result<(), Refusals> {
        self.shared.command(|core| {
            let index = core.read_channel(device, channel)?;
            if core.emergency.inputs.iter().any(|i| i.device == device && i.channel == index) {
                return Err(refuse(Class::InUse, format!("channel '{device}.{channel}' is an emergency stop input already"), "once is enough"));
            }
            core.physical[device].device.ask(index, Ask::Stop, at_zero);
            core.emergency.inputs.push(Input { device: device.to_owned(), channel: index, told: false });
            Ok(())
        })
    }

    /// Brings devices to their safe state and latches.
    pub fn emergency_stop(&self, reason: &str) -> Result<(), Refusals> {
        self.shared.command(|core| {
            core.emergency_stop("system", reason);
            Ok(())
        })
    }

    /// Why the emergency stop is latched; nothing where it is not.
    pub fn latched(&self) -> Option<String> {
        self.shared.locked().emergency.reason.clone()
    }

    /// Lifts the latch; processors that were lost get a new process, devices that were lost are opened again.
    pub fn reset(&self) -> Result<(), Refusals> {
        self.revive()?;
        self.reopen_lost()?;
        self.shared.command(Core::reset)
    }
}

impl Core {
    /// Index of a read channel of a physical device.
    pub fn read_channel(&self, device: &str, channel: &str) -> Result<usize, Refusals> {
        let Some(physical) = self.physical.get(device) else {
            return Err(unknown("physical device", device, self.physical.keys().map(String::as_str)));
        };
        let channels = physical.device.channels();
        let readable = |c: &&kernel::Channel| c.direction == Direction::Read;
        let found = channels.iter().position(|c| c.name == channel && c.direction == Direction::Read);
        found.ok_or_else(|| unknown("read channel", channel, channels.iter().filter(readable).map(|c| c.name.as_str())))
    }
}
