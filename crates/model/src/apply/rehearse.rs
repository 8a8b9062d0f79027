// SPDX-License-Identifier: Apache-2.0
//! Rehearsal: applies a verb without arguments, so that the checks made at installation find every mistake of the definition itself.
use super::activity::Activity;
use super::{Draft, GroupBinding};
use crate::checked::CheckedVerb;
use crate::configuration::{Configuration, Svv, SvvId};
use crate::definition::Application;
use crate::flatten::Origin;
use crate::interface::{Kind, Mode};
use crate::parameters::Whose;
use crate::types::Type;
use std::collections::HashMap;

/// Placeholder SVVs, by instantiation parameter, for devices that are not passed yet. Their types and units are those declared by the
/// device type.
pub(crate) struct StandIns(HashMap<usize, Vec<(String, Svv)>>);

impl StandIns {
    pub fn new(checked: &CheckedVerb, configuration: &Configuration) -> StandIns {
        let nothing = Application::default();
        let mut draft = Draft::new(checked, &nothing, configuration);
        let given: Vec<GroupBinding<'_>> = checked.groups.iter().map(|_| GroupBinding::Private).collect();
        draft.known_sizes(&given);
        // Ids of a system count from 0.
        let mut ids = (0..=u32::MAX).rev().map(SvvId);
        let mut members = HashMap::new();
        for (group, whose) in &checked.parameters {
            let Whose::Object { object: name, member } = whose else { continue };
            let Some(object) = checked.objects.get(name) else { continue };
            let Some(declared) = configuration.device_types.get(&object.device_type).and_then(|of| of.svvs.get(member)) else { continue };
            // A type that is defined only in a module's code is unknown until there is a device.
            if Type::parse(&declared.type_text, &Default::default()).is_err() {
                continue;
            }
            let count = if object.each { draft.count_of(*group).unwrap_or(1) } else { 1 };
            let named = |at: usize| if at == 0 { format!("{name}.{member}") } else { format!("{name}.{member} {at}") };
            let svv = |id: SvvId| Svv {
                id,
                type_text: declared.type_text.clone(),
                unit: declared.unit.clone(),
                types: Default::default(),
                history: declared.history,
                device: None,
                shared: false,
                place: None,
            };
            members.insert(*group, (0..count).map(named).zip(ids.by_ref().map(svv)).collect());
        }
        StandIns(members)
    }
}

impl<'a> Draft<'a> {
    /// Infers sizes and units to the extent that the definition determines them, and returns the provisional binding of each group.
    pub fn stand_in(&mut self, stand_ins: &'a StandIns) -> Vec<GroupBinding<'a>> {
        self.objects = vec![Vec::new(); self.checked.objects.len()];
        let mut given: Vec<GroupBinding<'a>> = self.checked.groups.iter().map(|_| GroupBinding::Private).collect();
        for (group, svvs) in &stand_ins.0 {
            given[*group] = GroupBinding::Svvs(svvs.iter().map(|(name, svv)| (name.as_str(), svv)).collect());
        }
        self.known_sizes(&given);
        self.infer_units(&given);
        given
    }

    /// Refuses everything that an installation would refuse regardless of the arguments. `is_whole` is true if there are no refusals so
    /// far, so anything missing was omitted from the definition.
    pub fn rehearse(&mut self, given: &[GroupBinding<'a>], is_whole: bool) {
        self.bind(given);
        let activity = self.activity();
        self.one_writer(&activity);
        let checked = self.checked;
        for input in &checked.inputs {
            self.input(input);
        }
        // Drivers are known only if nothing outside drives the verb.
        if is_whole && !self.is_driven_from_outside() && !self.takes_triggers(&activity) {
            match self.relations() {
                Ok(relations) => drop(self.relate(&activity, &relations)),
                Err(refusals) => self.refusals.extend(refusals),
            }
        }
    }

    /// Returns the number of elements of a group's ports, if it is known.
    fn count_of(&self, group: usize) -> Option<usize> {
        let mut layouts = self.checked.groups[group].ports.iter().filter_map(|port| self.layout(*port));
        layouts.find_map(|layout| if let Type::Array(_, count) = layout.read { Some(count) } else { None })
    }

    /// Returns true if a block runs on the trigger of its source, which is known only after the block has been placed.
    fn takes_triggers(&self, activity: &Activity) -> bool {
        let mut blocks = activity.on.iter().zip(&self.checked.driven);
        blocks.any(|(on, driven)| !driven && on.iter().any(|on| on.every_ns.is_none()))
    }

    fn is_driven_from_outside(&self) -> bool {
        let outside = self.checked.groups.iter().filter(|group| group.origin == Origin::Parameter).flat_map(|group| &group.ports);
        let mut inputs = outside.filter(|port| self.kind(**port) == Kind::Input);
        inputs.any(|port| self.flat(port.0).mode(port.1) != Mode::Asynchronous)
    }
}
