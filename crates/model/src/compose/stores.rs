// SPDX-License-Identifier: Apache-2.0
//! Values that a part needs when it begins. ψ stores them only once, at the start of the whole verb, so another part may overwrite them
//! before the part begins; a synchronous input may even have no writer while its part runs.
use super::Composing;
use super::part::PartOf;
use crate::flatten::{Origin, Port};
use crate::interface::{Kind, Mode};
use crate::refusal::Class;
use std::collections::HashMap;

/// A data object of the composed verb that several parts may use.
type Object = String;

impl Composing<'_> {
    /// Refuses inputs that are stored in the same location but have different names or a preset; inputs that another part overwrites
    /// before their own part begins; and synchronous inputs that only another part writes.
    pub fn check_stores(&mut self) {
        let mut stored: HashMap<Object, (usize, String)> = HashMap::new();
        for part in 0..self.parts.len() {
            let of = &self.parts[part];
            let stores: Vec<(Object, String, String)> = of
                .checked
                .inputs
                .iter()
                .flat_map(|input| input.ports.iter().filter_map(|port| Some((of.object(*port)?, of.input(&input.name), of.item(*port)))))
                .collect();
            for (object, input, item) in stores {
                match stored.get(&object).cloned() {
                    Some((first, known)) if first != part && known != input => {
                        let message = format!("the inputs '{known}' and '{input}' of {} are both stored in '{object}' at the start", self.both(first, part));
                        self.conflict(Class::CompositionConflict, message, "give them one name with rename=, or give each its own object", (first, part));
                    }
                    _ => drop(stored.insert(object.clone(), (part, input.clone()))),
                }
                if let Some((writer, port)) = self.writer(&object, part).filter(|_| self.comes_later(part)) {
                    let message = format!(
                        "the input '{input}' of part '{}' is stored in '{object}' ({item}) at the start, but {port} overwrites it before that part begins",
                        self.parts[part].label
                    );
                    self.conflict(Class::CompositionConflict, message, "give the input its own cell, or rename the parameter of one part", (writer, part));
                }
            }
            self.check_driven(part);
        }
    }

    /// Checks that every synchronous input of a part has a writer that runs at the same time as the part.
    fn check_driven(&mut self, part: usize) {
        if self.of.together {
            return;
        }
        let of = &self.parts[part];
        let mut starved = Vec::new();
        for group in of.checked.groups.iter().filter(|group| group.origin == Origin::Parameter) {
            let is_driven =
                |port: &&Port| of.checked.blocks[port.0].kind.item(port.1).kind == Kind::Input && of.checked.blocks[port.0].mode(port.1) == Mode::Synchronous;
            let writes = |port: &Port| is_output(of, *port);
            let Some(reader) = group.ports.iter().find(is_driven).filter(|_| !group.ports.iter().any(writes)) else { continue };
            let name = of.parameter(&group.name);
            if let Some((writer, port)) = self.writer(&name, part) {
                let message = format!(
                    "{} of part '{}' waits for values of '{name}', which {port} writes, but only while part '{}' runs",
                    of.item(*reader),
                    of.label,
                    self.parts[writer].label
                );
                let relaxed = crate::cycles::modes_of(&of.checked.blocks[reader.0], &[reader.1]);
                let remedy = format!("relax the input in verb '{}' with {relaxed}, or share the block that writes", of.verb.name);
                starved.push((message, remedy, (writer, part)));
            }
        }
        for (message, remedy, pair) in starved {
            self.conflict(Class::SchedulingError, message, &remedy, pair);
        }
    }

    /// Returns another part that writes an object, and the port that writes it.
    fn writer(&self, object: &str, part: usize) -> Option<(usize, String)> {
        (0..self.parts.len()).filter(|other| *other != part).find_map(|other| {
            let of = &self.parts[other];
            let ports = of.checked.groups.iter().flat_map(|group| &group.ports);
            let port =
                ports.copied().find(|port| is_output(of, *port) && !of.shared.contains(of.label_of(port.0)) && of.object(*port).as_deref() == Some(object))?;
            Some((other, of.item(port)))
        })
    }

    /// Returns true if a part begins only after another part has run.
    fn comes_later(&self, part: usize) -> bool {
        let of = &self.parts[part];
        let own: Vec<String> = (0..of.verb.command_lists.len()).flat_map(|list| of.lists_with(list)).collect();
        self.verb.transitions.iter().any(|line| own.contains(&line.to) && !own.contains(&line.from))
    }
}

impl PartOf<'_> {
    /// Returns the object of a port or parameter if other parts may also use the object.
    fn object(&self, port: Port) -> Option<Object> {
        let group = self.checked.group(port).map(|group| &self.checked.groups[group]);
        match group {
            Some(group) if group.origin == Origin::Parameter => return Some(self.parameter(&group.name)),
            Some(group) if self.shared_cells.contains(group.name.as_str()) => return Some(group.name.clone()),
            _ => {}
        }
        let block = &self.checked.blocks[port.0];
        self.shared.contains(self.label_of(port.0)).then(|| format!("{}.{}", block.label, block.kind.item(port.1).name))
    }

    /// Returns the name of an input parameter in the composed verb.
    fn input(&self, name: &str) -> String {
        let fixed = self.preset.contains_key(name) || self.verb.input_parameters.get(name).is_some_and(|input| input.preset);
        if fixed { format!("{}.{name}", self.label) } else { self.parameter(name) }
    }
}

fn is_output(of: &PartOf<'_>, (block, item): Port) -> bool {
    of.checked.blocks[block].kind.item(item).kind == Kind::Output
}
