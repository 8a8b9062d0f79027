// SPDX-License-Identifier: Apache-2.0
//! Manual and automatic mode. In manual mode, only actions declared for it can be started, and only while the enabling switch, if there
//! is one, is held; they end with `aborted` when it is released. The mode can be changed only at rest.
use crate::instances::instance::Instance;
use crate::refuse::refuse;
use crate::registry::Registry;
use model::refusal::{Class, Refusals};
use serde::{Deserialize, Serialize};

/// Mode of operation, which determines the actions that may be started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// All actions: a program runs the machine.
    #[default]
    Automatic,
    /// Actions declared for manual mode: a person moves the machine.
    Manual,
}

/// Mode, and the channel of the enabling switch, which is true while the switch is held.
#[derive(Default)]
pub(crate) struct Modes {
    pub mode: Mode,
    pub enabling: Option<(String, usize)>,
}

impl Mode {
    /// Returns the name of the mode.
    pub fn word(self) -> &'static str {
        match self {
            Mode::Automatic => "automatic",
            Mode::Manual => "manual",
        }
    }
}

impl Modes {
    /// Refuses a start that the mode does not permit.
    pub fn check(&self, instance: &Instance, registry: &Registry) -> Result<(), Refusals> {
        if self.mode == Mode::Automatic || !instance.is_action() {
            return Ok(());
        }
        let what = &instance.name;
        if !instance.plan.manual {
            let message = format!("cannot start '{what}': the system is in manual mode, but verb '{}' is not declared for it", instance.plan.verb);
            return Err(refuse(Class::InvalidState, message, "change to automatic mode, or declare the verb with manual=True"));
        }
        match self.enabling_switch(registry) {
            Some((false, name)) => {
                Err(refuse(Class::InvalidState, format!("cannot start '{what}' in manual mode: enabling switch '{name}' is not held"), "hold it while moving"))
            }
            _ => Ok(()),
        }
    }

    /// Returns the state of the enabling switch (true if it is held) and its name.
    pub fn enabling_switch(&self, registry: &Registry) -> Option<(bool, String)> {
        let (device, channel) = self.enabling.as_ref()?;
        let physical = &registry.physical[device].device;
        Some((!physical.asks(*channel), format!("{device}.{}", physical.channels()[*channel].name)))
    }
}
