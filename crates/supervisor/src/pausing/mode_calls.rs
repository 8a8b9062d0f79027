// SPDX-License-Identifier: Apache-2.0
//! Calls for manual and automatic mode.
use crate::pausing::modes::Mode;
use crate::refuse::refuse;
use crate::scripts::Purpose;
use crate::stopping::emergency_stop::set_mode;
use crate::stopping::latch::read_channel;
use crate::system::System;
use kernel::{Ask, Op};
use model::refusal::{Class, Refusals};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

impl System {
    /// Changes the mode; refused while an action on devices is running.
    pub fn set_mode(&self, mode: Mode) -> Result<(), Refusals> {
        self.shared.command(|core| set_mode(core, mode))
    }

    /// Returns the mode.
    pub fn mode(&self) -> Mode {
        self.shared.locked().safety.modes.mode
    }

    /// Sets the read channel that is nonzero while a person holds the enabling switch. There is only one; a later call replaces it.
    pub fn enabling_switch(&self, device: &str, channel: &str) -> Result<(), Refusals> {
        let done = Arc::new(AtomicBool::new(false));
        self.shared.command(|core| {
            let index = read_channel(&core.registry, device, channel)?;
            if core.safety.emergency.inputs.iter().any(|i| i.device == device && i.channel == index) {
                return Err(refuse(Class::InUse, format!("channel '{device}.{channel}' is an emergency stop input"), "use another channel for the switch"));
            }
            core.refuse_forced_switch(device, index)?;
            let physical = &core.registry.physical[device];
            let (source, of) = (physical.source, physical.device.clone());
            of.ask(index, Ask::Tell, true);
            core.safety.modes.enabling = Some((device.to_owned(), index));
            // A switch that is already held is recognised at once rather than at the next firing.
            core.submit(source, vec![Op::Look(of)], Purpose::Carried { done: done.clone() });
            Ok(())
        })?;
        // If the source does not answer, its switch counts as not held: nothing more to wait for.
        let _looked = self.shared.wait_for(None, LOOKED_MAX, |core| {
            let gone = core.registry.physical.get(device).is_none_or(|physical| core.safety.lost.contains(&physical.source));
            Ok((gone || done.load(Ordering::Acquire)).then_some(()))
        })?;
        Ok(())
    }
}

/// Time limit for a kernel to check a channel, which happens between two firings.
const LOOKED_MAX: Duration = Duration::from_secs(1);
