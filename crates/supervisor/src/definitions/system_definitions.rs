// SPDX-License-Identifier: Apache-2.0
//! Definitions: configuration and code, and the locations of processors.
use crate::copied::CopiedState;
use crate::definitions::catalog::Catalog;
use crate::processors::location::{Location, Processor};
use crate::refuse::{refuse, unknown};
use crate::starting::planned::Plans;
use indexmap::IndexMap;
use model::CheckedVerb;
use model::configuration::Configuration;
use model::definition::Application;
use model::plan::Plan;
use model::refusal::{Class, Refusals};
use std::collections::HashMap;
use std::sync::Arc;

/// Definitions of a system. Locked before the core if both are needed.
#[derive(Default)]
pub(crate) struct Definitions {
    pub configuration: CopiedState<Configuration>,
    pub catalog: Catalog,
    /// Verbs checked against the current code and device types.
    pub checked: HashMap<String, Arc<CheckedVerb>>,
    pub plans: Plans,
    pub processors: IndexMap<String, Processor>,
}

impl Definitions {
    /// Returns the checked form of a verb; rechecks it if a module that it may use has changed.
    pub fn checked(&mut self, verb: &str) -> Result<Arc<CheckedVerb>, Refusals> {
        if let Some(checked) = self.checked.get(verb) {
            return Ok(checked.clone());
        }
        let Some(definition) = self.configuration.verbs.get(verb) else {
            return Err(unknown("verb", verb, self.configuration.verbs.keys().map(String::as_str)));
        };
        let checked = Arc::new(CheckedVerb::new(definition, &self.configuration)?);
        self.checked.insert(verb.to_owned(), checked.clone());
        Ok(checked)
    }

    /// Returns the plan of an application in the current configuration, with its verb.
    pub fn planned(&mut self, application: &Application) -> Result<(Arc<CheckedVerb>, Arc<Plan>), Refusals> {
        let checked = self.checked(&application.verb)?;
        let plan = self.plans.of(application, &checked, &self.configuration)?;
        Ok((checked, plan))
    }
}

impl Definitions {
    /// Returns a processor in the process that a new processor is to share; `None` if the new one is the first. Fails if the process with
    /// that name belongs to a single processor.
    pub(crate) fn beside(&self, name: &str, location: &Location) -> Result<Option<&str>, Refusals> {
        let Some(process) = location.process(name) else { return Ok(None) };
        let Some((other, found)) = self.processors.iter().find(|(other, found)| found.location.process(other) == Some(process)) else { return Ok(None) };
        if *location == Location::Process || found.location == Location::Process {
            let (own, sharing) = if *location == Location::Process { (name, other.as_str()) } else { (other.as_str(), name) };
            return Err(refuse(
                Class::InUse,
                format!("processor '{own}' has its own process, which is called '{own}', but processor '{sharing}' names that process too"),
                format!("give the process of '{sharing}' another name, or let '{own}' share it: process=\"{process}\""),
            ));
        }
        Ok(Some(other))
    }
}
