// SPDX-License-Identifier: Apache-2.0
//! Definitions that are drawn, judged against what the system knows. Nothing is entered.
use crate::system::System;
use model::configuration::Configuration;
use model::refusal::Refusals;
use model::{Drawing, PortName, Verdict, check_definition, check_drawing, compatible, compatible_with};
use std::sync::Arc;

impl System {
    /// Returns the present configuration. A check, which may take long, holds no lock meanwhile.
    pub(crate) fn as_configured(&self) -> Arc<Configuration> {
        self.shared.definitions().configuration.as_it_is()
    }

    /// Returns all that is wrong with a definition, types and units too; nothing is entered.
    pub fn check_definition(&self, drawing: &Drawing) -> Result<Refusals, Refusals> {
        check_definition(drawing, &self.as_configured())
    }

    /// As [`System::check_definition`], and what installing it would refuse whatever it is given.
    pub fn check_drawing(&self, drawing: &Drawing) -> Result<Refusals, Refusals> {
        check_drawing(drawing, &self.as_configured())
    }

    /// Returns why two ports of a definition cannot be wired, if they cannot.
    pub fn compatible(&self, drawing: &Drawing, from: &PortName, to: &PortName) -> Result<Option<String>, Refusals> {
        compatible(drawing, &self.as_configured(), from, to)
    }

    /// Returns the same for one port and every other one.
    pub fn compatible_with(&self, drawing: &Drawing, from: &PortName) -> Result<Vec<Verdict>, Refusals> {
        compatible_with(drawing, &self.as_configured(), from)
    }
}
