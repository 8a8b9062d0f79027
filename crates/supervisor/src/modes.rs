// SPDX-License-Identifier: Apache-2.0
//! Manual and automatic mode. In manual mode only those actions on devices start that were declared for it, and only while the
//! enabling switch, where there is one, is held; they end with `aborted` when it is let go. The mode changes at rest only.
use crate::core::{Core, Purpose};
use crate::instance::Instance;
use crate::refuse::refuse;
use crate::system::System;
use kernel::{Ask, Op};
use model::refusal::{Class, Refusals};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How long a kernel may take to look at what it read: something that it does between two firings.
const LOOKED_MAX: Duration = Duration::from_secs(1);

/// What may be started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Everything: a program runs the machine.
    #[default]
    Automatic,
    /// Actions that were declared for it: a person moves the machine.
    Manual,
}

/// The mode, and the channel of the enabling switch: true while it is held.
#[derive(Default)]
pub(crate) struct Modes {
    pub mode: Mode,
    pub enabling: Option<(String, usize)>,
}

impl Core {
    /// Changes the mode; refused while an action on devices runs, naming it.
    pub fn set_mode(&mut self, mode: Mode) -> Result<(), Refusals> {
        if self.modes.mode == mode {
            return Ok(());
        }
        if let Some(action) = self.instances.values().find(|i| i.is_busy() && i.is_action()) {
            let (name, to) = (&action.name, name(mode));
            return Err(refuse(
                Class::InvalidState,
                format!("cannot change to {to} mode: '{name}' is {}", action.state.name()),
                format!("halt '{name}' first"),
            ));
        }
        self.modes.mode = mode;
        self.log.add(self.host.now_ns(), "mode", "system", name(mode));
        Ok(())
    }

    /// Refuses what the mode does not allow to start.
    pub fn check_mode(&self, instance: &Instance) -> Result<(), Refusals> {
        if self.modes.mode == Mode::Automatic || !instance.is_action() {
            return Ok(());
        }
        let what = &instance.name;
        if !instance.plan.manual {
            let message = format!("cannot start '{what}': the system is in manual mode and verb '{}' is not declared for it", instance.plan.verb);
            return Err(refuse(Class::InvalidState, message, "change to automatic mode, or declare the verb with manual=True"));
        }
        match self.enabling_switch() {
            Some((false, name)) => {
                Err(refuse(Class::InvalidState, format!("cannot start '{what}' in manual mode: enabling switch '{name}' is not held"), "hold it while moving"))
            }
            _ => Ok(()),
        }
    }

    /// Whether the enabling switch is held, and its name.
    fn enabling_switch(&self) -> Option<(bool, String)> {
        let (device, channel) = self.modes.enabling.as_ref()?;
        let physical = &self.physical[device].device;
        Some((!physical.asks(*channel), format!("{device}.{}", physical.channels()[*channel].name)))
    }

    /// In manual mode the actions end when the switch is let go.
    pub fn watch_enabling_switch(&mut self) {
        if self.modes.mode != Mode::Manual {
            return;
        }
        let Some((false, name)) = self.enabling_switch() else { return };
        let actions: Vec<u64> =
            self.instances.values().filter(|i| i.is_busy() && i.ending.is_none() && i.departure.is_none() && i.is_action()).map(|i| i.id).collect();
        for id in actions {
            self.end_by_name(id, "aborted", format!("enabling switch '{name}' was let go"));
        }
    }
}

fn name(mode: Mode) -> &'static str {
    match mode {
        Mode::Automatic => "automatic",
        Mode::Manual => "manual",
    }
}

impl System {
    /// Changes the mode; refused while an action on devices runs.
    pub fn set_mode(&self, mode: Mode) -> Result<(), Refusals> {
        self.shared.command(|core| core.set_mode(mode))
    }

    /// The mode.
    pub fn mode(&self) -> &'static str {
        name(self.shared.locked().modes.mode)
    }

    /// A read channel that is not 0 while a person holds the enabling switch. There is one; a later call takes its place.
    pub fn enabling_switch(&self, device: &str, channel: &str) -> Result<(), Refusals> {
        let done = Arc::new(AtomicBool::new(false));
        self.shared.command(|core| {
            let index = core.read_channel(device, channel)?;
            if core.emergency.inputs.iter().any(|i| i.device == device && i.channel == index) {
                return Err(refuse(Class::InUse, format!("channel '{device}.{channel}' is an emergency stop input"), "give the switch a channel of its own"));
            }
            let physical = &core.physical[device];
            let (source, of) = (physical.source, physical.device.clone());
            of.ask(index, Ask::Tell, true);
            core.modes.enabling = Some((device.to_owned(), index));
            // One that is held already reads so at once, not from the next firing on.
            core.submit(source, vec![Op::Look(of)], Purpose::Carried { done: done.clone() });
            Ok(())
        })?;
        // A source that does not answer has a switch that is not held: nothing more to wait for.
        let _looked = self.shared.wait_for(None, LOOKED_MAX, |core| {
            let gone = core.physical.get(device).is_none_or(|physical| core.lost.contains(&physical.source));
            Ok((gone || done.load(Ordering::Acquire)).then_some(()))
        })?;
        Ok(())
    }
}
