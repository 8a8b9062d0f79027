// SPDX-License-Identifier: Apache-2.0
//! Lists of the verbs and blocks of the system, for users who browse them or start a verb manually.
use crate::observation::description::ModuleAbout;
use crate::refuse::unknown;
use crate::system::System;
use indexmap::IndexMap;
use model::definition::{Part, Verb};
use model::interface::Interface;
use model::refusal::Refusals;
use model::{FormArgument, FormInput};
use serde::Serialize;

/// A one-line summary of a verb.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VerbSummary {
    pub name: String,
    pub doc: String,
    pub class: VerbClass,
    /// Device types that the verb supports.
    pub supports: Vec<String>,
    /// True if the verb has only one command list.
    pub simple: bool,
    /// Names of the verb's command lists.
    pub lists: Vec<String>,
    /// Parts of a composed verb, by label.
    pub parts: IndexMap<String, Part>,
}

/// Class of a verb: one of the two defined in the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum VerbClass {
    /// The verb operates the logical devices of a type.
    #[serde(rename = "supports devices")]
    SupportsDevices,
    #[serde(rename = "acts on devices")]
    ActsOnDevices,
}

/// Contents of a form for starting a verb.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VerbForm {
    pub name: String,
    pub doc: String,
    /// True if the verb may be started in manual mode.
    pub manual: bool,
    /// Arguments needed to create an instance.
    pub arguments: Vec<FormArgument>,
    /// Values that may be passed to a start.
    pub inputs: Vec<FormInput>,
    /// Definition of the verb.
    pub defined: Verb,
}

impl System {
    /// Returns the verbs with their names, descriptions, supported device types or the devices that they use, lists and parts.
    pub fn verbs(&self) -> Vec<VerbSummary> {
        let definitions = self.shared.definitions();
        let c = &definitions.configuration;
        let summary = |verb: &Verb| {
            let supports: Vec<String> = c.device_types.values().filter(|t| t.verb.as_ref() == Some(&verb.name)).map(|t| t.name.clone()).collect();
            VerbSummary {
                name: verb.name.clone(),
                doc: verb.doc.clone(),
                class: if supports.is_empty() { VerbClass::ActsOnDevices } else { VerbClass::SupportsDevices },
                supports,
                simple: verb.command_lists.len() == 1,
                lists: verb.command_lists.keys().cloned().collect(),
                parts: verb.parts.clone(),
            }
        };
        c.verbs.values().map(summary).collect()
    }

    /// Returns the contents of a form for starting a verb: its arguments and input parameters, and the definition itself.
    pub fn verb_form(&self, name: &str) -> Result<VerbForm, Refusals> {
        let mut definitions = self.shared.definitions();
        let Some(verb) = definitions.configuration.verbs.get(name).cloned() else {
            return Err(unknown("verb", name, definitions.configuration.verbs.keys().map(String::as_str)));
        };
        let checked = definitions.checked(name)?;
        Ok(VerbForm {
            name: verb.name.clone(),
            doc: verb.doc.clone(),
            manual: verb.manual,
            arguments: checked.form_arguments(),
            inputs: checked.form_inputs(),
            defined: verb,
        })
    }

    /// Returns the interfaces of all blocks in the library and the downloaded code modules.
    pub fn blocks(&self) -> Vec<Interface> {
        self.as_configured().interfaces.values().cloned().collect()
    }

    /// Returns the interfaces of the blocks of a module.
    pub fn module_about(&self, module: &str) -> ModuleAbout {
        let definitions = self.shared.definitions();
        let prefix = format!("{module}.");
        let blocks = definitions.configuration.interfaces.iter().filter(|(name, _)| name.starts_with(&prefix)).map(|(_, interface)| interface.clone());
        ModuleAbout { name: module.to_owned(), blocks: blocks.collect(), types: definitions.catalog.modules.get(module).cloned(), note: None }
    }
}
