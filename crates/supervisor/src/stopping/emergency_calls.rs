// SPDX-License-Identifier: Apache-2.0
//! The emergency stop: inputs, the stop, the reset.
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
    /// Makes a channel trip the emergency stop, from its next reading on, when it is not 0 (`at_zero`: when it is 0, as a normally
    /// closed contact does). Losing its device trips it too.
    pub fn emergency_stop_input(&self, device: &str, channel: &str, at_zero: bool) -> Result<(), Refusals> {
        self.shared.command(|core| {
            let index = read_channel(&core.registry, device, channel)?;
            if core.safety.emergency.inputs.iter().any(|i| i.device == device && i.channel == index) {
                return Err(refuse(Class::InUse, format!("channel '{device}.{channel}' is an emergency stop input already"), "once is enough"));
            }
            core.registry.physical[device].device.ask(index, Ask::Stop, at_zero);
            core.safety.emergency.inputs.push(Input { device: device.to_owned(), channel: index, told: false });
            Ok(())
        })
    }

    /// Brings devices to their safe state and latches.
    pub fn emergency_stop(&self, reason: &str) -> Result<(), Refusals> {
        // Whatever the supervisor does just now, from here on no device of this host takes anything but its safe values.
        self.shared.stop.store(true, Ordering::Release);
        first(|| {
            self.shared.command(|core| {
                emergency_stop(core, "system", reason);
                Ok(())
            })
        })
    }

    /// Returns why the emergency stop is latched; none if it is not.
    pub fn latched(&self) -> Option<String> {
        self.shared.locked().safety.emergency.reason.clone()
    }

    /// Lifts the latch; processors that were lost get a new process, devices that were lost are opened again. Returns the devices that are lost
    /// still, each with why.
    pub fn reset(&self) -> Result<BTreeMap<String, String>, Refusals> {
        self.revive()?;
        let still = self.reopen_lost()?;
        self.shared.command(lift)?;
        Ok(still)
    }
}
