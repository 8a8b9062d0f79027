// SPDX-License-Identifier: Apache-2.0
//! Definitions of verbs, graphs and device types. They may be added or changed at any time, provided that no running instance is
//! affected.
use crate::refuse::{known_unit, refuse, refuse_at, unknown};
use crate::system::System;
use indexmap::IndexMap;
use model::definition::{DeviceType, Graph, Verb};
use model::refusal::{Class, Refusals};
use model::types::Type;
use model::{CheckedVerb, Composition, check_graph, compose};
use std::sync::Arc;

impl System {
    /// Sets the placement: pattern for `verb.label` → source.
    pub fn place(&self, placement: IndexMap<String, String>) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        for source in placement.values() {
            if !definitions.configuration.sources.contains_key(source) {
                return Err(unknown("source", source, definitions.configuration.sources.keys().map(String::as_str)));
            }
        }
        definitions.configuration.placement.extend(placement);
        Ok(())
    }

    /// Adds a verb. An identical definition has no effect; a different one with the same name is refused while an instance is running.
    pub fn define_verb(&self, verb: Verb) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        if definitions.configuration.verbs.get(&verb.name) == Some(&verb) && definitions.checked.contains_key(&verb.name) {
            return Ok(());
        }
        self.refuse_busy(&verb.name, "redefine")?;
        let checked = CheckedVerb::new(&verb, &definitions.configuration)?;
        definitions.checked.insert(verb.name.clone(), Arc::new(checked));
        definitions.configuration.verbs.insert(verb.name.clone(), verb);
        Ok(())
    }

    /// Refuses the call if an instance of the verb is running or suspended.
    fn refuse_busy(&self, verb: &str, call: &str) -> Result<(), Refusals> {
        let core = self.shared.locked();
        match core.instances.values().find(|i| i.plan.verb == verb && i.is_busy()) {
            None => Ok(()),
            Some(busy) => Err(refuse(
                Class::InUse,
                format!("cannot {call} verb '{verb}': its instance '{}' is {}", busy.name, busy.state().name()),
                format!("halt '{}' first", busy.name),
            )),
        }
    }

    /// Checks a graph's definition; fails with all refusals.
    pub fn check_graph(&self, graph: &Graph) -> Result<(), Refusals> {
        let refusals = check_graph(graph, &self.as_configured());
        if refusals.is_empty() { Ok(()) } else { Err(refusals) }
    }

    /// Composes a verb from several verbs without adding it to the system.
    pub fn compose(&self, composition: &Composition) -> Result<Verb, Refusals> {
        compose(composition, &self.as_configured())
    }

    /// Adds a logical device type.
    pub fn define_device_type(&self, of: DeviceType) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        if definitions.configuration.device_types.get(&of.name) == Some(&of) {
            return Ok(());
        }
        if let Some(verb) = of.verb.as_ref().filter(|v| !definitions.configuration.verbs.contains_key(*v)) {
            return Err(unknown("verb", verb, definitions.configuration.verbs.keys().map(String::as_str)));
        }
        let device = definitions.configuration.logical_devices.iter().find(|(_, d)| d.device_type == of.name);
        if let Some((device, _)) = device {
            return Err(refuse_at(
                Class::InUse,
                format!("cannot redefine device type '{}': device '{device}' is of this type", of.name),
                format!("delete '{device}' first"),
                of.place,
            ));
        }
        let units = of.svvs.iter().map(|(name, svv)| (name, &svv.unit)).chain(of.parameters.iter().map(|(name, parameter)| (name, &parameter.unit)));
        for (name, unit) in units {
            known_unit(unit, &format!("'{name}' of device type '{}'", of.name), &of.place)?;
        }
        model::members::check_ranges(&of)?;
        for (name, svv) in &of.svvs {
            Type::parse(&svv.type_text, &IndexMap::new()).map_err(|r| vec![crate::starting::psi::named(r, name)])?;
        }
        definitions.configuration.device_types.insert(of.name.clone(), of);
        Ok(())
    }
}
