// SPDX-License-Identifier: Apache-2.0
//! `share`: blocks that are shared, so that all parts use the same instance. Their uses and bindings must be identical in all parts.
use super::Composing;
use super::part::{PartOf, is_within};
use crate::flatten::{Origin, Port};
use crate::kind::is_data;
use crate::refusal::Class;
use hints::did_you_mean;

impl Composing<'_> {
    /// Reads `share`: finds the shared blocks and cells of each part.
    pub fn read_shared(&mut self) {
        for label in &self.of.share {
            let having: Vec<usize> = (0..self.parts.len()).filter(|part| self.parts[*part].verb.blocks.contains_key(label)).collect();
            if self.of.parts.contains_key(label) {
                let message = format!("share= names the block '{label}', but a part of '{}' has that label", self.of.name);
                self.refuse(Class::CompositionConflict, message, "give the part another label", &None);
            } else if having.len() < 2 {
                let who = having.first().map_or_else(|| "no part has".to_owned(), |part| format!("only {} has", self.parts[*part].described()));
                let known = self.parts.iter().flat_map(|part| part.verb.blocks.keys().map(String::as_str)).filter(|known| *known != label.as_str());
                let remedy = did_you_mean(label, known.collect::<indexmap::IndexSet<_>>());
                self.refuse(Class::UnknownName, format!("share= names the block '{label}', which {who}"), &remedy, &None);
            } else {
                for part in &having {
                    self.parts[*part].share(label);
                }
                for part in &having[1..] {
                    self.check_shared(label, having[0], *part);
                }
            }
        }
    }

    fn check_shared(&mut self, label: &str, first: usize, second: usize) {
        let (a, b) = (&self.parts[first], &self.parts[second]);
        let both = self.both(first, second);
        let (used, also) = (&a.verb.blocks[label], &b.verb.blocks[label]);
        if used.block != also.block || used.constants != also.constants {
            let what = if used.block != also.block { "different blocks" } else { "different constants" };
            let message = format!("'{label}' cannot be shared by {both}: they are {what}");
            return self.conflict(Class::CompositionConflict, message, "make them equal, or leave it out of share", (first, second));
        }
        let mut conflicts = Vec::new();
        for (here, there) in a.flat_of(label).zip(b.flat_of(label)) {
            for item in 0..a.checked.blocks[here].kind.interface.items.len() {
                let declared = a.checked.blocks[here].kind.item(item);
                // An element that only the first part names is unbound in the second.
                let other = b.checked.blocks[there].kind.find(&declared.name);
                if !is_data(declared.kind) {
                    continue;
                }
                let port = (here, item);
                let (bound, to) = (a.binding(port), other.map_or_else(|| "nothing".to_owned(), |other| b.binding((there, other))));
                if bound != to {
                    let message =
                        format!("'{label}' cannot be shared by {both}: its {} is bound to {bound} in the first and to {to} in the second", a.item(port));
                    conflicts.push((message, "bind it to a parameter or cell of one name in both"));
                } else if other.is_some_and(|other| a.checked.blocks[here].mode(item) != b.checked.blocks[there].mode(other)) {
                    conflicts.push((format!("'{label}' cannot be shared by {both}: its {} has two modes", a.item(port)), "give it one mode with modes="));
                }
            }
        }
        for (message, remedy) in conflicts {
            self.conflict(Class::CompositionConflict, message, remedy, (first, second));
        }
    }
}

impl<'a> PartOf<'a> {
    /// Marks a block, and the cells to which it is bound, as shared.
    fn share(&mut self, label: &str) {
        let verb = self.verb;
        let Some((label, _)) = verb.blocks.get_key_value(label) else { return };
        self.shared.insert(label);
        let flat: Vec<usize> = self.flat_of(label).collect();
        let bound = |name: &&String| {
            self.checked.groups.iter().any(|g| g.origin != Origin::Parameter && g.name == **name && g.ports.iter().any(|p| flat.contains(&p.0)))
        };
        let cells: Vec<&'a str> = verb.cells.keys().filter(bound).map(String::as_str).collect();
        self.shared_cells.extend(cells);
    }

    /// Returns the flat blocks of the part to which a label refers.
    fn flat_of<'s>(&'s self, label: &'s str) -> impl Iterator<Item = usize> + 's {
        (0..self.checked.blocks.len()).filter(move |block| is_within(&self.checked.blocks[*block].label, label))
    }

    /// Returns the name, in the composed verb, of the binding of a port.
    fn binding(&self, port: Port) -> String {
        let Some(group) = self.checked.group(port).map(|group| &self.checked.groups[group]) else { return "nothing".to_owned() };
        match group.origin {
            Origin::Parameter => format!("the parameter '{}'", self.parameter(&group.name)),
            _ if self.verb.cells.contains_key(&group.name) => format!("the cell '{}'", self.cell(&group.name)),
            Origin::Cell => "a wire of its own graph".to_owned(),
            Origin::Filled => "its own cell".to_owned(),
            Origin::InputOnly => "only an input parameter".to_owned(),
            Origin::Constant => "its constant".to_owned(),
        }
    }
}
