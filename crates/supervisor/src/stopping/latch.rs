// SPDX-License-Identifier: Apache-2.0
//! Emergency stop: ends every action, brings devices to their safe state and latches. It is not a certified safety function.
//!
//! All devices of the host check a flag before each write. The kernel that reads a tripped input sets the flag in that very firing: its
//! own outputs are safe starting with that firing's write, those of other sources starting with their next write. The supervisor follows:
//! it ends the verbs, and nothing can be started until the reset.
use crate::refuse::{refuse, unknown};
use crate::registry::Registry;
use device::Direction;
use model::refusal::{Class, Refusals};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// State of the emergency stop, as kept by the supervisor.
#[derive(Default)]
pub(crate) struct Emergency {
    /// Cause of the latch.
    pub reason: Option<String>,
    /// Channels that trip the emergency stop.
    pub inputs: Vec<Input>,
    /// Flag that all devices of the host obey.
    pub stop: Arc<AtomicBool>,
}

/// A read channel that triggers a reaction.
pub(crate) struct Input {
    pub device: String,
    pub channel: usize,
    /// True if the input has been reported since the last reset.
    pub told: bool,
}

impl Emergency {
    /// Refuses a call while the emergency stop is latched.
    pub fn refuse(&self, call: &str, what: &str) -> Result<(), Refusals> {
        let Some(reason) = &self.reason else { return Ok(()) };
        Err(refuse(Class::EmergencyStopped, format!("cannot {call} '{what}': the emergency stop is latched ({reason})"), "remove the cause and call reset()"))
    }

    /// Returns descriptions of the causes that are still present.
    pub fn present(&self, registry: &Registry) -> Vec<String> {
        self.inputs.iter().filter(|input| registry.physical[&input.device].device.asks(input.channel)).map(|input| input.name(registry)).collect()
    }
}

impl Input {
    /// Returns the name of the input for messages, `emergency stop input 'io.gate'`, followed by the reason if the input tripped because
    /// its device was lost.
    pub fn name(&self, registry: &Registry) -> String {
        let name = format!("emergency stop input '{}'", self.channel_name(registry));
        if registry.physical[&self.device].device.is_lost() { format!("{name}: its device was lost") } else { name }
    }

    pub fn channel_name(&self, registry: &Registry) -> String {
        format!("{}.{}", self.device, registry.physical[&self.device].device.channels()[self.channel].name)
    }
}

/// Returns the index of a read channel of a physical device.
pub(crate) fn read_channel(registry: &Registry, device: &str, channel: &str) -> Result<usize, Refusals> {
    let Some(physical) = registry.physical.get(device) else {
        return Err(unknown("physical device", device, registry.physical.keys().map(String::as_str)));
    };
    let channels = physical.device.channels();
    let readable = |c: &&device::Channel| c.direction == Direction::Read;
    let found = channels.iter().position(|c| c.name == channel && c.direction == Direction::Read);
    found.ok_or_else(|| unknown("read channel", channel, channels.iter().filter(readable).map(|c| c.name.as_str())))
}
