// SPDX-License-Identifier: Apache-2.0
//! Calls that force signals, release them, and list the forced signals.
use crate::devices::forcing::ForceRequest;
use crate::refuse::{refuse, unknown};
use crate::system::System;
use indexmap::IndexMap;
use model::refusal::{Class, Refusals};
use model::value::Value;
use serde::Serialize;

/// A forced signal.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ForcedSignal {
    /// Number of the force, unique within the system.
    pub number: u64,
    /// Channel, `device.channel`.
    pub channel: String,
    /// True for an output, false for an input.
    pub output: bool,
    /// Value that replaces the reading or the command, in the unit of the channel.
    pub value: Value,
    /// Person or session that forces the signal.
    pub who: String,
    /// Time on the system's clock at which the signal was forced, s.
    pub since_s: f64,
}

impl System {
    /// Forces an input or output, identified by its logical device, until it is released. Returns the number of the force.
    ///
    /// # Errors
    /// Fails with `UnknownName` or `CallError` if the device is not a signal, with `NotEnabled` if it is not enabled, with `EmergencyStopped` while an emergency stop is latched, with `NotAllowed` for emergency stop inputs and the enabling switch, with `OutOfRange` for a value that the output cannot have, and with `InvalidState` if the mode does not allow it.
    pub fn force(&self, name: &str, value: &Value, who: &str) -> Result<u64, Refusals> {
        let definitions = self.shared.definitions();
        let asked = ForceRequest::of(&definitions.configuration, name, value, who)?;
        self.shared.command(|core| core.force(&asked))
    }

    /// Ends the forcing of one signal, or of all. Returns the signals that were forced.
    ///
    /// # Errors
    /// Fails with `UnknownName` if the logical device does not exist, and with `InvalidState` if it is not forced.
    pub fn unforce(&self, name: Option<&str>, who: &str) -> Result<Vec<String>, Refusals> {
        let why = format!("by {who}");
        self.shared.command(|core| {
            let Some(name) = name else { return Ok(core.release_forces(&why, |_, _| true)) };
            if core.release_force(name, &why) {
                return Ok(vec![name.to_owned()]);
            }
            core.registry.logical(name)?;
            let forced = core.safety.forces.by_signal.keys().map(String::as_str);
            let (refusals, message) = (unknown("forced signal", name, forced), format!("cannot release '{name}': it is not forced"));
            Err(refuse(Class::InvalidState, message, refusals.into_iter().next().map(|refusal| refusal.remedy).unwrap_or_default()))
        })
    }

    /// Ends the forces with these numbers, because the session that set them has ended.
    pub fn end_forces(&self, numbers: &[u64], why: &str) {
        // A closed system forces nothing.
        let _ended = self.shared.command(|core| Ok(core.release_forces(why, |_, force| numbers.contains(&force.number))));
    }

    /// Returns the forced signals, by logical device.
    pub fn forced(&self) -> IndexMap<String, ForcedSignal> {
        forced(&self.shared.locked())
    }
}

/// Returns the forced signals.
pub(crate) fn forced(core: &crate::core::Core) -> IndexMap<String, ForcedSignal> {
    let shown = core.safety.forces.by_signal.iter().map(|(name, force)| {
        let channel = core.registry.physical.get(&force.device).map_or("", |physical| &physical.device.channels()[force.channel].name);
        let (channel, output) = (format!("{}.{channel}", force.device), force.is_output);
        let (number, value, who, since_s) = (force.number, force.value.clone(), force.who.clone(), force.since_s());
        (name.clone(), ForcedSignal { number, channel, output, value, who, since_s })
    });
    shown.collect()
}
