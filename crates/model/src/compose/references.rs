// SPDX-License-Identifier: Apache-2.0
//! References in `rename` and `preset` to items of one part.
use super::Composing;
use super::part::PartOf;
use crate::conditions::is_system;
use crate::refusal::Class;
use hints::did_you_mean;
use indexmap::IndexSet;
use std::collections::HashMap;

/// Names of a verb's items, grouped into the sets within which they must be distinct.
pub(super) struct Names<'a> {
    /// Names of objects, instantiation parameters (`drive` of `drive.position`) and input parameters.
    pub parameters: IndexSet<&'a str>,
    pub outputs: IndexSet<&'a str>,
    pub conditions: IndexSet<&'a str>,
}

impl<'a> PartOf<'a> {
    pub fn names(&self) -> Names<'a> {
        let verb = self.verb;
        let root = |name: &'a str| name.split('.').next().unwrap_or(name);
        let own = verb.input_parameters.iter().filter(|(name, input)| !input.preset && !verb.objects.contains_key(root(name)));
        let parameters = verb.objects.keys().map(String::as_str).chain(verb.instantiation_parameters.keys().map(|name| root(name)));
        Names {
            parameters: parameters.chain(own.map(|(name, _)| name.as_str())).collect(),
            outputs: verb.output_values.keys().map(|key| verb.reported(key)).collect(),
            conditions: verb.conditions.keys().map(|key| verb.reported(key)).collect(),
        }
    }
}

impl<'a> Composing<'a> {
    /// Reads `rename` and `preset`.
    pub fn read_references(&mut self) {
        for (key, to) in &self.of.rename {
            self.rename(key, to);
        }
        for part in 0..self.parts.len() {
            self.check_renamed(part);
        }
        for (key, value) in &self.of.preset {
            let Some((part, name)) = self.part_and_name("preset", key) else { continue };
            let verb = self.parts[part].verb;
            match verb.input_parameters.get(name) {
                Some(input) if !input.preset => {
                    self.parts[part].preset.insert(name, value);
                    self.check_preset(part, name);
                }
                _ => {
                    let described = self.parts[part].described();
                    let inputs = verb.input_parameters.iter().filter(|(_, input)| !input.preset);
                    let remedy = did_you_mean(name, inputs.map(|(name, _)| name.as_str()));
                    self.refuse(Class::UnknownName, format!("preset= names '{key}', but {described} has no input parameter '{name}'"), &remedy, &None);
                }
            }
        }
    }

    fn rename(&mut self, key: &'a str, to: &'a str) {
        let Some((part, name)) = self.part_and_name("rename", key) else { return };
        let names = self.parts[part].names();
        if !names.parameters.contains(name) && !names.outputs.contains(name) && !names.conditions.contains(name) {
            let known = names.parameters.iter().chain(&names.outputs).chain(&names.conditions).copied();
            let remedy = did_you_mean(name, known);
            let message = format!("rename= names '{key}', but {} has no parameter, object, output or condition '{name}'", self.parts[part].described());
            return self.refuse(Class::UnknownName, message, &remedy, &None);
        }
        if to.is_empty() || to.contains('.') {
            self.refuse(
                Class::DefinitionError,
                format!("rename= gives '{key}' the name '{to}', which is empty or contains a dot"),
                "give it a plain name",
                &None,
            );
        } else if names.conditions.contains(name) && (is_system(to) || is_system(name)) {
            let message = format!("rename= calls the condition '{key}' '{to}', but a system condition keeps its name and stands for itself");
            self.refuse(Class::DefinitionError, message, "give it another name", &None);
        } else {
            self.parts[part].renamed.insert(name, to);
        }
    }

    /// Checks that no two items of a part have the same name in the composed verb.
    fn check_renamed(&mut self, part: usize) {
        let names = self.parts[part].names();
        for (what, names) in [("parameters", &names.parameters), ("outputs", &names.outputs), ("conditions", &names.conditions)] {
            let mut seen: HashMap<String, &str> = HashMap::new();
            for name in names {
                let new = self.parts[part].own(name).to_owned();
                if let Some(other) = seen.insert(new.clone(), name) {
                    let message = format!("rename= merges two {what} of {}: '{other}' and '{name}' would both be '{new}'", self.parts[part].described());
                    self.refuse(Class::CompositionConflict, message, "give them different names", &None);
                }
            }
        }
    }

    /// Splits `approach.speed` into the part and the name within it.
    fn part_and_name(&mut self, what: &str, key: &'a str) -> Option<(usize, &'a str)> {
        let found = key.split_once('.').and_then(|(label, name)| Some((self.parts.iter().position(|part| part.label == label)?, name)));
        if found.is_none() {
            let label = key.split('.').next().unwrap_or(key);
            let remedy = if key.contains('.') { did_you_mean(label, self.of.parts.keys().map(String::as_str)) } else { "write part.name".to_owned() };
            self.refuse(Class::UnknownName, format!("{what}= names '{key}', but no part of '{}' is called '{label}'", self.of.name), &remedy, &None);
        }
        found
    }

    fn check_preset(&mut self, part: usize, name: &str) {
        let of = &self.parts[part];
        let Some(input) = of.checked.inputs.iter().find(|input| input.name == name) else { return };
        let Some(&(block, item)) = input.ports.first() else { return };
        let kind = &of.checked.blocks[block].kind;
        let unit = if input.unit.is_empty() { &kind.item(item).unit } else { &input.unit };
        // The length of a sized item is known only when the verb is applied.
        let encoded = kind.layout(item, None).map(|layout| layout.read.encode(of.preset[name], unit));
        if let Some(Err(refusal)) = encoded {
            let refusal = refusal.for_what(&format!("the preset of '{name}' of {}", of.described()));
            self.refusals.push(refusal.at(&self.of.place));
        }
    }
}
