// SPDX-License-Identifier: Apache-2.0
//! Calls for the emergency stop: inputs, stop and reset.
use crate::precedence::first;
use crate::refuse::refuse;
use crate::stopping::emergency_stop::{emergency_stop, lift};
use crate::stopping::latch::{Input, read_channel};
use crate::system::System;
use kernel::Ask;
use model::refusal::{Class, Refusals};
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

impl System {
    /// Makes a channel trip the emergency stop, starting with its next reading, whenever it is nonzero (or, if `at_zero` is true,
    /// whenever it is 0, as with a normally closed contact). The loss of the channel's device also trips the stop.
    pub fn emergency_stop_input(&self, device: &str, channel: &str, at_zero: bool) -> Result<(), Refusals> {
        self.shared.command(|core| {
            let index = read_channel(&core.registry, device, channel)?;
            if core.safety.emergency.inputs.iter().any(|i| i.device == device && i.channel == index) {
                return Err(refuse(Class::InUse, format!("channel '{device}.{channel}' is already an emergency stop input"), "leave the second one out"));
            }
            core.refuse_forced_switch(device, index)?;
            core.registry.physical[device].device.ask(index, Ask::Stop, at_zero);
            core.safety.emergency.inputs.push(Input { device: device.to_owned(), channel: index, told: false });
            Ok(())
        })
    }

    /// Brings all devices to their safe state and latches the emergency stop.
    pub fn emergency_stop(&self, reason: &str) -> Result<(), Refusals> {
        // Regardless of the supervisor's current work, every device of this host now accepts only its safe values.
        self.shared.stop.store(true, Ordering::Release);
        first(|| {
            self.shared.command(|core| {
                emergency_stop(core, "system", reason);
                Ok(())
            })
        })
    }

    /// Returns the reason why the emergency stop is latched; `None` if it is not.
    pub fn latched(&self) -> Option<String> {
        self.shared.locked().safety.emergency.reason.clone()
    }

    /// Releases the latch, restarts lost processors in new processes, and reopens lost devices. Returns the devices that are still lost,
    /// with the reasons.
    pub fn reset(&self) -> Result<BTreeMap<String, String>, Refusals> {
        self.revive()?;
        let still = self.reopen_lost()?;
        self.shared.command(lift)?;
        Ok(still)
    }
}
