// SPDX-License-Identifier: Apache-2.0
//! Checks of drawn definitions against the configuration of the system. Nothing is added to the system.
use crate::system::System;
use model::configuration::Configuration;
use model::refusal::Refusals;
use model::{Drawing, PortName, Verdict, check_definition, check_drawing, compatible, compatible_with};
use std::sync::Arc;

impl System {
    /// Returns a snapshot of the configuration, so that a long check need not hold a lock.
    pub(crate) fn as_configured(&self) -> Arc<Configuration> {
        self.shared.definitions().configuration.as_it_is()
    }

    /// Returns all mistakes of a definition, including types and units. Does not add it to the system.
    pub fn check_definition(&self, drawing: &Drawing) -> Result<Refusals, Refusals> {
        check_definition(drawing, &self.as_configured())
    }

    /// Checks as [`System::check_definition`] does, and adds everything that an installation would refuse regardless of the arguments.
    pub fn check_drawing(&self, drawing: &Drawing) -> Result<Refusals, Refusals> {
        check_drawing(drawing, &self.as_configured())
    }

    /// Returns the reason why two ports of a definition cannot be wired; `None` if they can.
    pub fn compatible(&self, drawing: &Drawing, from: &PortName, to: &PortName) -> Result<Option<String>, Refusals> {
        compatible(drawing, &self.as_configured(), from, to)
    }

    /// Returns, for each other port, the reason why `from` cannot be wired to it, if it cannot.
    pub fn compatible_with(&self, drawing: &Drawing, from: &PortName) -> Result<Vec<Verdict>, Refusals> {
        compatible_with(drawing, &self.as_configured(), from)
    }
}
